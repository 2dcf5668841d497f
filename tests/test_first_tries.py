"""Research on interfaces: the block of each learner is on the page, with the seed of its training."""

import ast
import re

import pytest

from research import interfaces
from research.interfaces import Learner, printed
from research.learners.protocol import LEARNERS
from uuv_marl.baselines import POLICIES
from uuv_marl.errors import ResultsError


@pytest.mark.parametrize("learner", list(Learner))
def test_the_page_prints_every_learner_and_trainings_have_seeds_of_their_own(learner):
    first, third = printed(learner, 0), printed(learner, 2)
    ast.parse(third)
    seeds = [[int(seed) for seed in re.findall(r"seed[=(]([\d_]+)", block)] for block in (first, third)]
    assert seeds[1] == [seed + 2000 for seed in seeds[0]]
    assert ("IppoConfig" in first) == (learner is Learner.IPPO)


def test_no_learner_has_the_name_of_a_policy_that_ships():
    assert not {*LEARNERS, *map(str, Learner)} & {*POLICIES}


def test_a_page_without_the_block_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(interfaces, "PAGE", tmp_path / "page.md")
    (tmp_path / "page.md").write_text("```python\nprint('MappoConfig.')\n```\n")
    for learner in (Learner.RLLIB, Learner.MAPPO, Learner.IPPO):
        with pytest.raises(ResultsError, match=f"must print a block of {learner} with a seed"):
            printed(learner, 0)

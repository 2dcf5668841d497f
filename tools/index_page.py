"""The README as a package index shows it: links into the repository become addresses there, or plain text.

The address is ``Repository`` in ``[project.urls]`` of pyproject.toml. A hook of hatchling, run by every build.
"""

import re

from hatchling.metadata.plugin.interface import MetadataHookInterface

PICTURE = re.compile(r"!\[([^\]]*)\]\((?!https?:)([^)]*)\)(\n*)")
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((?!https?:|#)([^)]*)\)")


def page(text, repository):
    """The text without relative links: with the repository's address before each; without one, pictures go.

    Args:
        text: Markdown of the README.
        repository: address such as https://github.com/OWNER/uuv_marl; None where it is not known.
    """
    if repository is None:
        return LINK.sub(r"\1", PICTURE.sub("", text))
    home = repository.rstrip("/")
    text = PICTURE.sub(rf"![\1]({home}/raw/HEAD/\2)\3", text)
    return LINK.sub(rf"[\1]({home}/blob/HEAD/\2)", text)


class IndexPage(MetadataHookInterface):
    """Sets the field ``readme``."""

    def update(self, metadata):
        """Called by hatchling with the table ``project`` of pyproject.toml."""
        with open(self.root + "/README.md", encoding="utf-8") as file:
            text = page(file.read(), metadata.get("urls", {}).get("Repository"))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}

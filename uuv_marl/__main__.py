"""``python -m uuv_marl`` is ``uuv-marl``."""

from uuv_marl.cli import main

main()

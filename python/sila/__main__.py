"""`python -m sila`: as the program `sila`."""

from ._program import main

main()

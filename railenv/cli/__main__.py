"""``python -m railenv.cli``."""

from railenv.cli.application import main

if __name__ == "__main__":
    main()

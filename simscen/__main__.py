"""Entry point of `python -m simscen`, which does the same as the command `simscen`."""

from simscen.cli.start import start

if __name__ == "__main__":
    start()

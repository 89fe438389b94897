"""Run the command line with `python -m simscen`, for example if the program `simscen` is not on PATH."""

from simscen.cli.start import start

if __name__ == "__main__":
    start()

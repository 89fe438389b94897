"""`python -m simscen`: the command line, where its program is not on the path."""

from simscen.cli.start import start

if __name__ == "__main__":
    start()

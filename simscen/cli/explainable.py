"""All that `explain` knows."""

from simscen.cli.catalogue import Topic, topics
from simscen.cli.codetopics import code_topics
from simscen.cli.keytopics import keys_of_topics
from simscen.cli.metrics import metric_topics
from simscen.cli.signals import signal_topics
from simscen.loading.codes import CODES


def everything() -> list[Topic]:
    """Every topic, in the order of the overview; codes of problems apart."""
    return [*topics(installed=True), *signal_topics(), *metric_topics(installed=True), *code_topics()]


def known_names(keys: bool = False) -> list[str]:
    """What there is to explain, in order; with `keys` the paths of keys instead."""
    found = everything()
    return keys_of_topics(found) if keys else [*dict.fromkeys(topic.name for topic in found), *CODES]

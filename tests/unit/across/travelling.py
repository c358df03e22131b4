"""Whether what a core wants said can travel."""

from cell.core import Answer, Effect, Publish
from cell.messages import Reply
from cell.net.codec import decode, encode


def fit_to_travel(effect: Effect) -> None:
    match effect:
        case Publish(message):
            decode(type(message), encode(message))
        case Answer(_, reply):
            assert isinstance(reply, Reply)
            decode(Reply, encode(reply))

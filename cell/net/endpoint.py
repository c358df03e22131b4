"""Who answers at an endpoint: for the message of a process that wanted to listen there itself."""

import uuid

import zenoh

from cell.messages import Call, Reply, Who
from cell.net.codec import decode, encode_call
from cell.net.errors import CodecError, ConfigurationError
from cell.net.options import Link, ZenohOptions, zenoh_config

_PATIENCE_S = 1.0


def who_answers(endpoint: str, options: ZenohOptions) -> str:
    """One sentence about the program that listens on `endpoint`, found within about a second."""
    plain = ZenohOptions(config=options.config, settings=options.settings)
    link = Link("client", connect=(endpoint,), open_timeout_s=_PATIENCE_S)
    try:
        session = zenoh.open(zenoh_config(link, plain))
    except (zenoh.ZError, ConfigurationError):
        return "a program that does not speak Zenoh, or not to us, answers there"
    with session:
        answers = _introductions(session)
        if answers:
            return f"{'; '.join(answers)} answers there"
        tokens = session.liveliness().get("cell/*/alive/**", timeout=_PATIENCE_S)
        names = sorted(str(reply.ok.key_expr) for reply in tokens if reply.ok is not None)
        return f"a Zenoh program answers there (tokens: {', '.join(names) or 'none'})"


def _introductions(session: zenoh.Session) -> list[str]:
    """What the processes that listen (manager, gateways) say of themselves, the one at the endpoint first."""
    neighbours = {str(zid) for zid in session.info.peers_zid()} | {str(zid) for zid in session.info.routers_zid()}
    payload = encode_call(Call(uuid.uuid4().hex, Who()))
    found: dict[str, bool] = {}
    for key in ("cell/*/manager/cmd/who", "cell/*/gateway/*/cmd/who"):
        for reply in session.get(key, payload=payload, timeout=_PATIENCE_S, target=zenoh.QueryTarget.ALL):
            if reply.ok is None:
                continue
            try:
                text = decode(Reply, reply.ok.payload.to_bytes()).text
            except CodecError:
                continue
            found[text] = reply.replier_id is not None and str(reply.replier_id.zid) in neighbours
    direct = [text for text, near in found.items() if near]
    return direct or sorted(found)

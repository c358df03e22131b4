"""The two ends of a heartbeat, on virtual time."""

from drive_gateway.sim.services.heartbeat import HeartbeatConsumer, HeartbeatProducer


def test_heartbeats_do_not_drift_when_they_are_asked_for_late() -> None:
    producer = HeartbeatProducer()
    producer.configure(10, 0.0)
    assert sum(producer.due(0.007 * step) for step in range(1, 1001)) == 700


def test_heartbeats_are_not_caught_up_after_a_pause() -> None:
    producer = HeartbeatProducer()
    producer.configure(10, 0.0)
    due = [producer.due(now) for now in (5.0, 5.0, 5.001, 5.002)]
    assert sum(due) <= 2


def test_period_zero_sends_nothing() -> None:
    producer = HeartbeatProducer()
    producer.configure(0, 0.0)
    assert not producer.due(1000.0)


def test_loss_is_noticed_once() -> None:
    consumer = HeartbeatConsumer()
    consumer.configure(5 << 16 | 100)
    consumer.heard(1.0)
    assert [consumer.missed(now) for now in (1.09, 1.11, 1.2)] == [False, True, False]


def test_next_heartbeat_ends_a_loss() -> None:
    consumer = HeartbeatConsumer()
    consumer.configure(5 << 16 | 100)
    consumer.heard(1.0)
    consumer.missed(2.0)
    assert [consumer.heard(3.0), consumer.heard(3.05)] == [True, False]

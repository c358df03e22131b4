"""All invariants on one world."""

from collections import defaultdict
from collections.abc import Callable, Collection
from typing import Any

from cell.core import Effect
from tests.sim.judge import bodies, grants, motion, news, orders, room, states
from tests.sim.judge.facts import STRANGER, Facts, Sample
from tests.sim.judge.invariant import Broken, Invariant
from tests.sim.world import World

ALL: tuple[type[Invariant], ...] = (
    bodies.OneBodyInAZone,
    bodies.BodyIsPublished,
    bodies.InsideIsAccountedFor,
    bodies.BrakingKeepsZones,
    bodies.BlockIsPublished,
    bodies.StopTimeIsTrue,
    grants.NoBreach,
    grants.EntersByFreshGrant,
    grants.NothingLeadsIn,
    grants.HoldsWhatIsGranted,
    grants.KeepsWhileInside,
    grants.GivenUpStaysGivenUp,
    grants.BreachStops,
    grants.GrantsAreDue,
    grants.FirstComeFirstServed,
    grants.AdoptsAlone,
    grants.HolderLetsGo,
    grants.ClaimsAreHonoured,
    grants.OccupiedIsTheCase,
    news.TokensGrow,
    news.SequencesGrow,
    news.EchoesGrow,
    news.JournalIsMended,
    motion.WithinLimits,
    motion.DrivesGetWhatIsSaid,
    motion.OnThisMotion,
    motion.PlaysBlocks,
    motion.StopsWithoutManager,
    motion.StopsUnderEstop,
    motion.GatewayObeysEstop,
    motion.ConfirmedIsStopped,
    motion.LateCyclesStop,
    motion.MovesByOrder,
    motion.StandsWithoutTorque,
    motion.StopsEndAtRest,
    motion.BlocksKeepComing,
    motion.HaltsEnd,
    motion.BlocksEndAtRest,
    motion.BlocksAreTaken,
    states.ModesHaveCauses,
    states.OperatorDecides,
    states.ModeIsTheCase,
    states.SaysWhyItStands,
    states.FeedbackIsNeeded,
    states.FaultyDrivesStop,
    states.JogsWhileHeld,
    states.FreeZonesAreGranted,
    states.SilentHoldersAreBlocked,
    orders.OrdersInTime,
    orders.StopsAreKept,
    orders.OneOwner,
    orders.OutputsByOrder,
    orders.EffortIsBounded,
    room.KeptApart,
    room.BodyIsOwned,
    room.BlockIsOwned,
    room.QueueIsReserved,
    room.OwnedIsCleared,
    room.OwnedKeptApart,
    room.BoxesAreLeftAlone,
    room.SaysForWhom,
)


class Judge:
    """Watches a world from its beginning; raises `Broken` out of its clock."""

    def __init__(
        self, world: World, only: Collection[str] | None = None, on_broken: Callable[[Broken], None] | None = None
    ) -> None:
        """`only`: the names of the invariants to look at; without it all. `on_broken`: instead of raising."""
        self.facts = Facts(world)
        self.invariants = [kind(self.facts) for kind in ALL if only is None or kind.name in only]
        self._on_broken = on_broken
        self._published = self._handlers("published")
        self._delivered = self._handlers("delivered")
        self._effects = self._handlers("effects")
        kinds = [each for each in self.invariants if type(each).look is not Invariant.look]
        self._looks = [self._judged(each.look) for each in kinds]
        self.facts.on_samples = self._look
        world.on_published.append(self._on_published)
        world.on_delivered.append(self._on_delivered)
        world.on_effect.append(self._on_effect)
        world.on_life.append(self._on_life)
        world.clock.on_pause.append(self.flush)

    def _handlers(self, kind: str) -> dict[type, list[Callable[[str, Any], None]]]:
        handlers: dict[type, list[Callable[[str, Any], None]]] = defaultdict(list)
        for invariant in self.invariants:
            for message, handler in getattr(invariant, kind).items():
                handlers[message].append(self._judged(handler))
        return handlers

    def _on_published(self, name: str, message: object) -> None:
        if name == STRANGER:
            return
        for handler in self._published.get(type(message), ()):
            handler(name, message)
        self.facts.published(name, message)

    def _on_delivered(self, name: str, message: object) -> None:
        for handler in self._delivered.get(type(message), ()):
            handler(name, message)
        self.facts.delivered(name, message)

    def _on_effect(self, name: str, effect: Effect) -> None:
        for handler in self._effects.get(type(effect), ()):
            handler(name, effect)

    def _on_life(self, name: str, what: str) -> None:
        self.facts.lived(name, what)
        for invariant in self.invariants:
            invariant.lived(name, what)

    def _look(self, sample: Sample) -> None:
        for look in self._looks:
            look(sample)

    def flush(self) -> None:
        """Judge everything that was kept for later."""
        self.facts.flush()
        for invariant in self.invariants:
            self._judged(invariant.flush)()

    def _judged(self, what: Callable[..., None]) -> Callable[..., None]:
        """What does the same, and tells what it finds broken where it has not to be raised."""
        on_broken = self._on_broken
        if on_broken is None:
            return what

        def judge(*arguments: object) -> None:
            try:
                what(*arguments)
            except Broken as broken:
                on_broken(broken)

        return judge

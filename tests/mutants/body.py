"""Faults of the checks of things, spaces and the robot itself (docs/architecture.md, 4.8): they are looked for by brute
force."""

from tests.mutants.mutant import Bench, Edit, Mutant

THINGS = "robot_agent/workspace/things.py"
SPACES = "robot_agent/workspace/spaces.py"
ITSELF = "robot_agent/workspace/itself.py"
COVER = "robot_agent/workspace/cover.py"

_OPEN = "        if not open_.any():\n            break\n"
_SIDES = "    sides = np.stack([clear[:-1], clear[1:]])\n    touches = _too_near(taus, clear)\n"

BODY = (
    # What is looked at
    Mutant(
        "pairs-left-out",
        "every other pair of links that can meet is not looked at",
        (
            Edit(
                ITSELF,
                "    return pairs[:, (distances >= apart.margin_m).any(axis=0)]",
                "    return pairs[:, (distances >= apart.margin_m).any(axis=0)][:, ::2]",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "tool-not-in-body",
        "the tool does not count as a part of the body",
        (
            Edit(
                THINGS,
                "    moving = [number for number, capsule in enumerate(model.body) if capsule.link > 0]",
                "    moving = [n for n, capsule in enumerate(model.description.capsules) if capsule.link > 0]",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "tool-not-apart",
        "the tool may come into the arm",
        (
            Edit(
                ITSELF,
                "        return links[one] != links[other] and not held and names not in free",
                "        return links[one] != links[other] and not held and names not in free and max(one, other) < own",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "thin-body",
        "links of a swept body are lines",
        (
            Edit(
                "robot_agent/workspace/swept_body.py",
                "    return Sweep(points, model.capsule_radii, chords,",
                "    return Sweep(points, 0.0 * model.capsule_radii, chords,",
            ),
        ),
        bench=Bench.BODY,
    ),
    # How near
    Mutant(
        "margin-of-things-forgotten",
        "a thing may be touched as long as it is not entered",
        (
            Edit(
                THINGS,
                "Barrier(solid, thing.margin_m, _kept_away(model, free))",
                "Barrier(solid, 0.0, _kept_away(model, free))",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "margin-of-itself-forgotten",
        "links may touch each other as long as they do not enter each other",
        (Edit(ITSELF, "        self.margin_m = model.description.apart.margin_m", "        self.margin_m = 0.0"),),
        bench=Bench.BODY,
    ),
    Mutant(
        "margin-of-spaces-forgotten",
        "a safe space may be left up to its border",
        (
            Edit(
                SPACES,
                "    return _Rule(Barrier(room, least, watched), broken,",
                "    return _Rule(Barrier(room, 0.0, watched), broken,",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "safe-boxes-alone",
        "of several safe spaces only the first counts",
        (
            Edit(
                SPACES,
                "    room = Room(tuple(_convex(each) for each in on), tuple(each.margin_m - least for each in on))",
                "    room = Room((_convex(on[0]),), (on[0].margin_m - least,))",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "cone-twice-as-wide",
        "a tool may tilt twice as far as is allowed",
        (
            Edit(
                SPACES,
                "np.sin((self.within_rad - angle) / 2.0)",
                "np.sin((2.0 * self.within_rad - angle) / 2.0)",
            ),
        ),
        bench=Bench.BODY,
    ),
    # When
    Mutant(
        "samples-skipped",
        "every other sample of a motion counts as far from everything",
        (Edit(THINGS, _SIDES, "    clear[1::2] = np.inf\n" + _SIDES),),
        bench=Bench.BODY,
    ),
    Mutant(
        "nothing-between-samples",
        "only samples are looked at, and not the way between them",
        (Edit(THINGS, _OPEN, "        if True:\n            break\n"),),
        bench=Bench.BODY,
    ),
    Mutant(
        "bulge-forgotten",
        "the body is taken to go straight from sample to sample",
        (
            Edit(
                THINGS,
                "    ways, bulge = kept.way(path.chords), kept.bodies * path.bulge\n",
                "    ways, bulge = kept.way(path.chords), 0.0 * path.bulge\n",
            ),
        ),
        "samples of a planned motion are so close that its bulge is far below a millimetre; "
        "`test_what_lies_between_two_samples_far_apart_is_seen_by_the_bulge` sees it",
        bench=Bench.BODY,
    ),
    Mutant(
        "one-pose-for-a-stretch",
        "a stretch of a motion is looked at in one pose",
        (
            Edit(
                COVER,
                "        radii = path.radii + grown + bulge[:, None] + _ROUNDING_M",
                "        radii = path.radii + 0.0 * grown + bulge[:, None] + _ROUNDING_M",
            ),
        ),
        bench=Bench.BODY,
    ),
    # What is sent
    Mutant(
        "ramp-of-a-jog-not-looked-at",
        "of a jog's block only what comes before its ramp is looked at",
        (
            Edit(
                "robot_agent/trajectory/sources/jog.py",
                "        why = self._clear(states)\n",
                "        why = self._clear(states.first(30))\n",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "ramp-of-a-correction-not-looked-at",
        "of a corrected block only what comes before its ramp is looked at",
        (
            Edit(
                "robot_agent/trajectory/sources/corrected.py",
                "        why = self._clear(states)\n",
                "        why = self._clear(states.first(max(count, 1)))\n",
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "input-of-a-space-ignored",
        "a space that an input has switched on holds nobody",
        (
            Edit(
                "robot_agent/agent/zones/zone_claims.py",
                "            if (why := self.spaces.why_on(crossing.zone, now))\n",
                '            if (why := "")\n',
            ),
        ),
        bench=Bench.BODY,
    ),
    Mutant(
        "way-out-leads-deeper",
        "who is too near already may go anywhere",
        (
            Edit(
                THINGS,
                "path.radii, first[inside] - _ROUNDING_M)",
                "path.radii, first[inside] - 1.0)",
            ),
        ),
        bench=Bench.BODY,
    ),
)

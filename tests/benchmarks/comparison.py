"""Which cases are measured with which contestants, round by round, and what they come to."""

import dataclasses
import statistics
import sys

import peers
import service


@dataclasses.dataclass(frozen=True)
class Settings:
    programs: object  # folder of the programs
    study: object  # cluster.toml
    measured_s: float
    rounds: int


@dataclasses.dataclass(frozen=True)
class Case:
    mode: str  # "burn" or "sleep"
    duration_us: int
    workers: int  # processes that execute
    in_flight: int  # roll-outs, of all runs

    def name(self):
        time = (f"{self.duration_us // 1000} ms" if self.duration_us >= 1000
                else f"{self.duration_us} us")
        deed = "busy" if self.mode == "burn" else "asleep"
        return f"{deed} {time}, {self.workers} evaluators, {self.in_flight} in flight"

    def runs(self):
        return min(64, self.in_flight)

    def settings_of_study(self):
        words = []
        for key, value in (("task.mode", self.mode), ("task.duration_us", self.duration_us),
                           ("study.repetitions", self.runs()),
                           ("study.in_flight", self.in_flight // self.runs())):
            words += ["--set", f"{key}={value}"]
        return words

    def burnt_us(self):
        return self.duration_us if self.mode == "burn" else 0


@dataclasses.dataclass(frozen=True)
class Contestant:
    name: str
    measure: object  # of (settings, case) -> {"rate": ..., "learner_us": ...}


LIMIT = Contestant("no messaging", peers.alone)
SERVICE = Contestant("treeroll", service.measure)
BUSY = [Case("burn", duration_us, 2, 64) for duration_us in (10_000, 1000, 100, 10)]
ASLEEP = [Case("sleep", duration_us, workers, 4 * workers)
          for workers in (16, 64, 256) for duration_us in (1000, 10_000, 100_000)]
ALONE = [Case("burn", duration_us, 1, 1) for duration_us in (1000, 100, 10)]
QUICK_BUSY = [Case("burn", 1000, 2, 64)]
QUICK_ASLEEP = [Case("sleep", 10_000, 16, 64)]
QUICK_ALONE = [Case("burn", 100, 1, 1)]


def say(text):
    print(text, file=sys.stderr, flush=True)


def busy_contestants(settings, skipped):
    found = [LIMIT, SERVICE,
             Contestant("socketpair pool, 16 a message", peers.pool(16)),
             Contestant("socketpair pool, 1 a message", peers.pool(1))]
    optional = [
        ("OpenMPI, {} a message", peers.mpi, peers.why_no_mpi(settings)),
        ("ProcessPoolExecutor, {} a task", lambda batch: peers.python("executor", batch), ""),
        ("dask.distributed, {} a task", lambda batch: peers.python("dask", batch),
         peers.why_no_dask()),
    ]
    for name, make, why_not in optional:
        if why_not:
            skipped.append(f"{name.split(',')[0]}: {why_not}")
            continue
        found += [Contestant(name.format(batch), make(batch)) for batch in (16, 1)]
    return found


def parts(settings, quick, skipped):
    """Cases, their contestants, and whom the others are compared with: the first."""
    ping_pong = Contestant("socketpair ping-pong", peers.pool(1))
    pool = Contestant("socketpair pool, 1 a message", peers.pool(1))
    with_keys = Contestant("treeroll with keys", service.measure_with_keys)
    multicast = Contestant("treeroll over multicast", service.measure)
    tcpq = Contestant("treeroll over tcpq", service.measure_over_tcpq)
    yield ("busy", QUICK_BUSY if quick else BUSY, busy_contestants(settings, skipped))
    yield ("asleep", QUICK_ASLEEP if quick else ASLEEP, [LIMIT, SERVICE, pool])
    yield ("one in flight", QUICK_ALONE if quick else ALONE, [ping_pong, SERVICE])
    yield ("keys", QUICK_BUSY if quick else BUSY, [SERVICE, with_keys])
    if why_not := service.tcpq_hub()[1]:
        skipped.append(f"tcpq: {why_not}")
    else:
        yield ("tcpq", QUICK_BUSY if quick else BUSY[1:3], [multicast, tcpq])


def spread(values):
    return {"median": statistics.median(values), "min": min(values), "max": max(values)}


def summed_up(case, contestant, first, rounds, base):
    """Ratios are to the base of the same round: what slows a round down slows both."""
    row = {
        "contestant": contestant.name,
        "rate": spread([measured["rate"] for measured in rounds]),
        "ratio": spread([measured["rate"] / of_base["rate"]
                         for measured, of_base in zip(rounds, base)]),
        "ratio_to": first.name,
    }
    for key in ("learner_us", "worker_us", "evaluator_us", "share"):
        if all(key in measured for measured in rounds):
            row[key] = spread([measured[key] for measured in rounds])
    return {"case": case.name(), **dataclasses.asdict(case), **row}


def compare(settings, quick, after_round):
    """Everything in each round, one after the other; then medians over the rounds."""
    skipped = []
    plan = list(parts(settings, quick, skipped))
    for line in skipped:
        say(f"skipped: {line}")
    measured = {}
    for number in range(settings.rounds):
        for part, cases, contestants in plan:
            for case in cases:
                for contestant in contestants:
                    one = contestant.measure(settings, case)
                    say(f"round {number + 1} of {settings.rounds}: {part}: {case.name()}: "
                        f"{contestant.name}: {one['rate']:.0f} a second")
                    measured.setdefault((part, case, contestant.name), []).append(one)
        after_round()
    rows = []
    for part, cases, contestants in plan:
        for case in cases:
            base = measured[part, case, contestants[0].name]
            rows += [{"part": part,
                      **summed_up(case, contestant, contestants[0],
                                  measured[part, case, contestant.name], base)}
                     for contestant in contestants]
    return rows, skipped


def on_the_wire(settings, quick):
    """What a result costs on the wire. Apart: whoever listens costs time of his own."""
    rows = []
    for case in QUICK_BUSY if quick else BUSY:
        wire = service.measure(settings, case, listens=True)["wire"]
        say(f"on the wire: {case.name()}: {sum(wire['bytes_a_result'].values()):.0f} bytes a result")
        rows.append({"case": case.name(), **wire})
    return rows

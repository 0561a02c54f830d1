"""The service itself as a contestant: real daemons, measured from outside while they work."""

import contextlib
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import peers

# The journal's events, as learner/journal/journal_record.h describes them.
HEADER = struct.Struct(">4sqqii")
SYNC = b"\xed\xa1\xda\x01"
KIND_OFFSET = 44
KIND_RESULT = 2

START_LIMIT_S = 60
END_LIMIT_S = 60
# The learner sees how long roll-outs take, and fills its workers by it.
WARM_UP_S = 0.5


def processor_s(pid):
    """Processor time of a process that runs: what clock_getcpuclockid(3) names."""
    return time.clock_gettime((~pid << 3) | 2)


def children_of(pid):
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def results_between(journal, begin_us, end_us):
    """How many results a journal has from begin_us up to end_us on the wall clock."""
    text = journal.read_bytes()
    count = 0
    offset = 0
    while offset + HEADER.size <= len(text):
        sync, _, wall_us, channel_bytes, data_bytes = HEADER.unpack_from(text, offset)
        size = HEADER.size + channel_bytes + data_bytes
        if sync != SYNC:
            raise RuntimeError(f"{journal}: no record at byte {offset}")
        if offset + size > len(text):  # being written
            break
        if text[offset + KIND_OFFSET] == KIND_RESULT and begin_us <= wall_us < end_us:
            count += 1
        offset += size
    return count


def check_journal(journal, rollouts, runs):
    """Our reading of the journal against the learner's: all roll-outs, and the evaluation of each
    run's start."""
    in_journal = results_between(journal, 0, sys.maxsize)
    with rollouts.open("rb") as lines:
        in_table = sum(1 for _ in lines) - 1
    if not in_table <= in_journal <= in_table + runs:
        raise RuntimeError(f"{journal} has {in_journal} results, {rollouts} {in_table}")


def any_multicast_url():
    return (f"udpm://239.255.{random.randrange(80, 180)}.{random.randrange(1, 250)}:"
            f"{random.randrange(20000, 50000)}?ttl=0")


class Listener:
    """Counts messages and bytes by channel on a multicast group, as one more receiver."""

    MAGIC = b"LC02"

    def __init__(self, url):
        group, port = url.removeprefix("udpm://").split("?")[0].split(":")
        self.messages = {}
        self.bytes = {}
        self.lost = 0
        self._last = {}
        self._counts = False
        self._ends = False
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
        self._socket.bind((group, int(port)))
        member = struct.pack("=4sI", socket.inet_aton(group), socket.INADDR_ANY)
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        self._socket.settimeout(0.1)
        self._thread = threading.Thread(target=self._listen)
        self._thread.start()

    def begin(self):
        self._counts = True

    def end(self):
        self._counts = False
        self._ends = True
        self._thread.join()
        self._socket.close()

    def _listen(self):
        while not self._ends:
            try:
                datagram, sender = self._socket.recvfrom(65535)
            except TimeoutError:
                continue
            if datagram[:4] != self.MAGIC:
                continue
            number = struct.unpack_from(">I", datagram, 4)[0]
            before = self._last.get(sender)
            self._last[sender] = number
            if not self._counts:
                continue
            if before is not None:
                self.lost += number - before - 1
            channel = datagram[8:datagram.index(b"\0", 8)].decode()
            self.messages[channel] = self.messages.get(channel, 0) + 1
            self.bytes[channel] = self.bytes.get(channel, 0) + len(datagram)


class Daemon:
    """A program of the build, ended with the block it is made in."""

    def __init__(self, words, folder):
        self.name = Path(words[0]).name
        self._log = folder / f"{self.name}.log"
        with self._log.open("wb") as log:
            self._process = subprocess.Popen([str(word) for word in words], stdout=log, stderr=log,
                                             stdin=subprocess.DEVNULL)
        self.pid = self._process.pid

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()

    def check_runs(self):
        if self._process.poll() is not None:
            self.fail(f"has ended with status {self._process.returncode}")

    def fail(self, what):
        tail = self._log.read_text(errors="replace")[-2000:]
        raise RuntimeError(f"{self.name} {what}:\n{tail}")

    def stop(self, statuses):
        self._process.send_signal(signal.SIGTERM)
        try:
            status = self._process.wait(END_LIMIT_S)
        except subprocess.TimeoutExpired:
            self.fail(f"has not ended after {END_LIMIT_S} s")
        if status not in statuses:
            self.fail(f"has ended with status {status}")


class Snapshot:
    """When it is, and what each process has burnt by then."""

    def __init__(self, learner, worker):
        self.us = time.time_ns() // 1000
        self.learner_s = processor_s(learner.pid)
        self.worker_s = processor_s(worker.pid)
        self.evaluators_s = sum(processor_s(pid) for pid in children_of(worker.pid))


def await_results(journal, learner, worker):
    deadline = time.monotonic() + START_LIMIT_S
    while not (journal.exists() and journal.stat().st_size > 4096):
        learner.check_runs()
        worker.check_runs()
        if time.monotonic() > deadline:
            learner.fail(f"has no results after {START_LIMIT_S} s")
        time.sleep(0.02)


def key_files(settings, folder):
    """Options of learner and worker, whose messages are signed and checked then."""
    learner, worker = folder / "learner.key", folder / "worker.key"
    keygen = settings.programs / "treeroll-keygen"
    subprocess.run([keygen, learner], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([keygen, worker, "--worker-of", learner], check=True, stdout=subprocess.DEVNULL)
    return ["--key-file", learner], ["--key-file", worker]


def measure_with_keys(settings, case):
    return measure(settings, case, has_keys=True)


def measure(settings, case, url=None, listens=False, has_keys=False):
    """Starts a worker daemon and a learner, looks at both while they work, and stops them."""
    url = url or any_multicast_url()
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="treeroll-bench-")))
        of_learner, of_worker = key_files(settings, folder) if has_keys else ([], [])
        listener = None
        if listens:
            listener = Listener(url)
            stack.callback(listener.end)
        worker = stack.enter_context(Daemon(
            [settings.programs / "treeroll-worker", "--processes", case.workers,
             "--lcm-url", url, *of_worker], folder))
        learner = stack.enter_context(Daemon(
            [settings.programs / "treeroll-learner", settings.study, "--lcm-url", url,
             "--state-dir", folder / "state", *of_learner, *case.settings_of_study()], folder))
        journal = folder / "state" / "journal.lcmlog"
        await_results(journal, learner, worker)
        # A long roll-out takes a while to come from every run.
        time.sleep(WARM_UP_S + 10e-6 * case.duration_us)
        if listener:
            listener.begin()
        before = Snapshot(learner, worker)
        time.sleep(settings.measured_s)
        after = Snapshot(learner, worker)
        if listener:
            listener.end()
        learner.check_runs()
        learner.stop({3})  # stopped early
        worker.stop({0})
        results = results_between(journal, before.us, after.us)
        check_journal(journal, folder / "state" / "rollouts.csv", case.runs())
    if results == 0:
        raise RuntimeError(f"treeroll has no result within {settings.measured_s} s")
    measurement = peers.with_share(case, {
        "rate": results / (after.us - before.us) * 1e6,
        "learner_us": (after.learner_s - before.learner_s) / results * 1e6,
        "worker_us": (after.worker_s - before.worker_s) / results * 1e6,
        "evaluator_us": (after.evaluators_s - before.evaluators_s) / results * 1e6
        - case.burnt_us(),
    })
    if listener:
        measurement["wire"] = {
            "messages_a_result": {channel: number / results
                                  for channel, number in sorted(listener.messages.items())},
            "bytes_a_result": {channel: number / results
                               for channel, number in sorted(listener.bytes.items())},
            "datagrams_lost": listener.lost,
        }
    return measurement


def tcpq_hub():
    """The hub's command up to its port, or why there is none."""
    jar = Path("/usr/share/java/lcm.jar")
    if not jar.exists():
        return None, f"{jar} is not there (deploy/install-packages spy)"
    if peers.find_program("java") is None:
        return None, "there is no java (deploy/install-packages spy)"
    return ["java", "-cp", str(jar), "lcm.lcm.TCPService"], ""


def measure_over_tcpq(settings, case):
    command, _ = tcpq_hub()
    port = random.randrange(20000, 50000)
    with tempfile.TemporaryDirectory(prefix="treeroll-bench-") as folder:
        with Daemon([*command, port], Path(folder)) as hub:
            deadline = time.monotonic() + START_LIMIT_S
            while True:
                hub.check_runs()
                with contextlib.suppress(OSError):
                    socket.create_connection(("127.0.0.1", port), 1).close()
                    break
                if time.monotonic() > deadline:
                    hub.fail("takes no connections")
                time.sleep(0.05)
            return measure(settings, case, url=f"tcpq://127.0.0.1:{port}")

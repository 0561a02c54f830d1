"""A worker written from lcmtypes/PROTOCOL.md alone, for the tests: one process, one evaluation at a
time. Numbers in brackets are those of the rules there.

    worker.py FILE.py:CLASS LCM_URL [--drop FRACTION] [--key-file FILE]

loses such a share of its messages, both ways, and signs what it says.
"""

import argparse
import hashlib
import json
import os
import random
import signal
import socket
import struct
import time

from treeroll.__main__ import load_task
from treeroll.authentication import UNSIGNED, Authenticator, KeyRing
from treeroll.lcm_bus import UdpmBus
from treeroll.lcm_types import MessageError, Types
from treeroll.policy import Policy
from treeroll.program import _Program

KINDS = {"TREEROLL_ROLLOUTS": "rollout_batch_t", "TREEROLL_DEFINITIONS": "definition_piece_t",
         "TREEROLL_LEARNER": "learner_status_t"}
CHANNELS = {"reward_batch_t": "TREEROLL_REWARDS", "worker_status_t": "TREEROLL_WORKERS",
            "definition_request_t": "TREEROLL_REQUESTS", "definition_report_t": "TREEROLL_REPORTS"}
STATUS = {"reward": 0, "failed": 2, "discarded": 5}
TASK, POLICY, THETA = 0, 1, 2
SLOTS, RESULTS_PER_BATCH, PIECE_BYTES, DEFINITION_BYTES_MAX, REPORT_BYTES_MAX = 16, 3, 1024, 1 << 20, 1024
FIRST_KEY = {"run": 0, "number": -2**31}
LAST_KEY = {"run": 2**31 - 1, "number": 2**31 - 1}


class Link:
    """What there is between this worker and one learner."""

    def __init__(self, now, last_index):
        self.heard, self.last_batch, self.received = now, 0, 0
        self.answers = {}
        self.last_index = self.sent = self.seen = last_index
        self.repeat_at, self.pause = None, 0.0

    def take_batch(self, sequence):  # [10]
        step = sequence - self.last_batch
        if step > 0:
            self.received = (self.received << step | 1) & (2**64 - 1) if step < 64 else 1
            self.last_batch = sequence
        elif step > -64:
            self.received |= 1 << -step


class Worker:
    def __init__(self, task, url, drop, key_file):
        self.types = Types()
        self.bus = UdpmBus(url, set(KINDS))
        self.drop = random.Random(os.getpid()).random if drop else None
        self.fraction = drop
        self.id = int.from_bytes(os.urandom(8), "big") >> 1 or 1  # [1]
        keys = KeyRing(key_file) if key_file else None
        self.id = keys.worker_id(self.id) if keys else self.id  # [26]
        self.signer = Authenticator(keys, self.id) if keys else None
        self.program = _Program((task,))
        self.tasks, self.policies, self.thetas = {}, {}, {}
        self.pieces, self.refused, self.reports, self.links, self.queue = {}, {}, {}, {}, []
        self.last_indices, self.heard, self.num_workers = {}, set(), 0
        self.described, self.draining, self.num_evaluated = None, False, 0
        self.heartbeat_at, self.ask_at, self.leaves_at = 0.0, 0.0, 0.0

    def send(self, kind, **fields):
        if self.drop is None or self.drop() >= self.fraction:
            data = self.types.encode(kind, {**fields, **UNSIGNED})
            self.bus.publish(CHANNELS[kind],
                             self.signer.sign(CHANNELS[kind], data) if self.signer else data)

    def take_bytes(self, channel, data, now):
        if self.signer and not self.signer.is_signed(channel, data):  # [27]
            return
        message = self.types.decode(KINDS[channel], data)
        if self.signer and not self.signer.admit(channel, data, message):  # [28]
            return
        getattr(self, "on_" + KINDS[channel])(message, now)

    def has_ended(self, now):  # [24]
        if not self.draining or self.queue:
            return False
        self.leaves_at = self.leaves_at or now + 5
        return now >= self.leaves_at or not any(link.answers for link in self.links.values())

    def serve(self):
        while not self.has_ended(time.monotonic()):
            received = self.bus.receive(0.0 if self.ready() else 0.002)
            while received is not None:
                if self.drop is None or self.drop() >= self.fraction:
                    try:
                        self.take_bytes(*received, time.monotonic())
                    except (MessageError, UnicodeDecodeError):
                        pass  # [4]
                received = self.bus.receive()
            request = self.ready()
            if request is not None:
                self.queue.remove(request)
                self.answer(request)
            self.speak(time.monotonic())
        self.send_status()  # [24]

    def on_learner_status_t(self, message, now):
        if message["learner_id"] not in self.heard:  # [8]
            self.heard.add(message["learner_id"])
            self.heartbeat_at = 0.0
        if message["learner_id"] in self.links:
            self.links[message["learner_id"]].heard = now
            self.num_workers = message["num_workers"]

    def on_rollout_batch_t(self, batch, now):
        named = [a for a in batch["acknowledgements"] if a["worker_id"] == self.id]
        asked = [r for r in batch["rollouts"] if r["worker_id"] == self.id]
        if not named and not asked and batch["learner_id"] not in self.links:
            return
        link = self.links.setdefault(
            batch["learner_id"], Link(now, self.last_indices.get(batch["learner_id"], 0)))
        link.heard = now
        if link.last_batch == 0:
            self.heartbeat_at = 0.0  # [8]
        link.take_batch(batch["sequence"])
        for word in named:  # [15] [16]
            link.seen = max(link.seen, min(word["seen_index"], link.sent))
            for index in [i for i in link.answers if i <= word["result_index"]]:
                del link.answers[index]
            if link.seen >= link.last_index:
                link.repeat_at, link.pause = now + 0.25, 0.25
        for request in asked:
            self.take(batch["learner_id"], link, request)

    def take(self, learner, link, request):
        question = (learner, request["key"]["run"], request["key"]["number"])
        for index, result in link.answers.items():  # [14]
            if result["key"] == request["key"] and result["content"] == request["content"]:
                self.send_batch(learner, link, index)
                return
        held = [r for r in self.queue if r["question"] == question]
        if any(r["content"] == request["content"] for r in held):
            return
        self.queue = [r for r in self.queue if r["question"] != question]
        if not self.draining and len(self.queue) < SLOTS:
            self.queue.append({**request, "learner": learner, "question": question})

    def on_definition_piece_t(self, piece, now):  # [18] to [20]
        name, total = (piece["kind"], piece["definition_id"]), piece["total_bytes"]
        count = -(-total // PIECE_BYTES)
        if piece["kind"] == THETA and not any(name[1] in r["theta_ids"] for r in self.queue):
            return
        if not 0 < total <= DEFINITION_BYTES_MAX or not 0 <= piece["index"] < count:
            return
        if self.has(name):
            if name in self.reports and piece["index"] == 0:  # [21] also again
                self.report(piece["learner_id"], name)
            return
        mine = self.pieces.setdefault((piece["learner_id"], name, total), {})
        mine[piece["index"]] = piece["piece"]
        if len(mine) < count:
            return
        del self.pieces[(piece["learner_id"], name, total)]
        content = b"".join(mine[i] for i in range(count))
        if hashlib.blake2b(content, digest_size=16).digest() == name[1]:
            self.define(piece["learner_id"], name, content)

    def has(self, name):
        return name[1] in (self.tasks, self.policies, self.thetas)[name[0]] or name in self.refused

    def define(self, learner, name, content):  # [21]
        if name[0] == THETA:
            self.thetas[name[1]] = struct.unpack(f">{len(content) // 8}d", content)
            return
        text = ""
        try:
            text = self.load(name, content)
        except (ValueError, KeyError) as error:
            self.refused[name] = str(error)[:1000] or "refused"
        if name[0] == POLICY and name not in self.refused:
            return
        self.reports[name] = self.refused.get(name) or text
        self.report(learner, name)

    def report(self, learner, name):
        self.send("definition_report_t", worker_id=self.id, learner_id=learner, definition_id=name[1],
                  accepted=name not in self.refused, text=self.reports[name])

    def load(self, name, content):
        if name[0] == POLICY:
            self.policies[name[1]] = Policy(content)
            return "{}"
        task = json.loads(content)
        said = self.describe(task)
        settings = said.pop("settings")
        names = {key: said.pop(key) for key in ("inputs", "outputs") if key in said}
        if "described" in task and (task["described"], task["settings"]) != (said, settings):
            raise ValueError("this worker's task is another one than the study's")
        self.tasks[name[1]] = task
        self.described = name[1]
        text = json.dumps({**said, **names})
        return text if len(text.encode()) <= REPORT_BYTES_MAX else json.dumps(said)

    def describe(self, task):
        said = self.program.describe({"name": task["name"], "settings": task["settings"]})
        if "refused" in said:
            raise ValueError(said["refused"])
        return said

    def ready(self):
        return next((r for r in self.queue if not self.missing(r)), None)

    def missing(self, request):
        needs = [(TASK, request["task_id"]), (POLICY, request["policy_id"]),
                 *((THETA, i) for i in request["theta_ids"])]
        return [name for name in needs if not self.has(name) or name in self.refused]

    def answer(self, request):
        start = time.monotonic_ns()
        if self.described != request["task_id"]:
            self.describe(self.tasks[request["task_id"]])
            self.described = request["task_id"]
        theta = self.thetas[request["theta_ids"][0]] if request["theta_ids"] else request["theta"]
        policy = self.policies[request["policy_id"]]
        policy.theta = theta
        said = self.program.evaluate({"run": request["key"]["run"], "rollout": request["key"]["number"],
                                      "policy": policy.text, "seed": request["task_seed"] % 2**64})
        word = next(w for w in STATUS if w in said)
        self.num_evaluated += 1
        link = self.links[request["learner"]]
        link.last_index += 1  # [12]
        link.answers[link.last_index] = {
            "key": request["key"], "attempt": request["attempt"], "content": request["content"],
            "reward": said.get("reward", 0.0), "status": STATUS[word],
            "reason": "" if word == "reward" else said[word][:200],
            "duration_ns": time.monotonic_ns() - start}

    def send_batch(self, learner, link, first):  # [11] to [13]
        last = min(first + RESULTS_PER_BATCH - 1, link.last_index)
        results = [link.answers[i] for i in range(first, last + 1) if i in link.answers]
        bits = link.received - 2**64 if link.received >= 2**63 else link.received
        self.send("reward_batch_t", worker_id=self.id, learner_id=learner,
                  last_batch=link.last_batch, batches_received=bits, free_slots=self.free_slots(),
                  oldest_index=min(link.answers, default=link.last_index + 1), first_index=first,
                  num_results=len(results), results=results)
        return first + len(results)

    def speak(self, now):
        for learner, link in list(self.links.items()):
            if now > link.heard + 60:  # [25]
                self.last_indices[learner] = link.last_index
                del self.links[learner]
                self.queue = [r for r in self.queue if r["learner"] != learner]
                continue
            oldest = min(link.answers, default=link.last_index + 1)
            if link.sent < link.last_index:
                first = max(link.sent + 1, oldest)
                link.repeat_at, link.pause = now + 0.005, 0.005
            elif link.answers and link.repeat_at is not None and now >= link.repeat_at:  # [15]
                first = max(link.seen + 1, oldest) if link.seen < link.last_index else oldest
                link.pause = min(2 * link.pause, 1.0)
                link.repeat_at = now + link.pause
            else:
                continue
            while first <= link.last_index:
                first = self.send_batch(learner, link, first)
            link.sent = link.last_index
        if now >= self.ask_at:
            self.ask()
            self.ask_at = now + 0.02
        if now >= self.heartbeat_at:
            self.send_status()
            pause = 0.1 if self.queue else 0.25
            self.heartbeat_at = now + max(pause, self.num_workers / 640)  # [6]

    def ask(self):  # [19]
        for learner in self.links:
            wanted = {name for r in self.queue if r["learner"] == learner for name in self.missing(r)}
            wanted = [{"kind": kind, "definition_id": i, "num_pieces": 0, "pieces": []}
                      for kind, i in sorted(wanted - set(self.refused))]
            if wanted:
                self.send("definition_request_t", worker_id=self.id, learner_id=learner,
                          num_definitions=len(wanted[:16]), definitions=wanted[:16])

    def free_slots(self):
        return 0 if self.draining else SLOTS - len(self.queue)

    def send_status(self):  # [7]
        held = []
        for learner, link in self.links.items():
            keys = sorted((r["key"] for r in self.queue if r["learner"] == learner),
                          key=lambda key: (key["run"], key["number"]))
            held.append({"learner_id": learner, "last_batch": link.last_batch,
                         "last_index": link.last_index, "num_keys": len(keys), "keys": keys,
                         "first": FIRST_KEY, "last": LAST_KEY})
        self.send("worker_status_t", worker_id=self.id, host=socket.gethostname(), pid=os.getpid(),
                  version="from the wire alone", numeric_class="python", num_evaluators=1,
                  free_slots=self.free_slots(), receive_buffer_bytes=self.bus.receive_buffer_bytes,
                  draining=self.draining, num_evaluated=self.num_evaluated, num_failed=0,
                  num_repeated=0, num_restarts=0, num_rejected=0, num_held=len(held), held=held)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("task")
    parser.add_argument("url")
    parser.add_argument("--drop", type=float, default=0.0)
    parser.add_argument("--key-file")
    arguments = parser.parse_args()
    worker = Worker(load_task(arguments.task), arguments.url, arguments.drop, arguments.key_file)
    signal.signal(signal.SIGTERM, lambda *_: setattr(worker, "draining", True))  # [23]
    worker.serve()


if __name__ == "__main__":
    main()

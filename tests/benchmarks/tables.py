"""Measurements as text for a person, the same in the terminal and on a page."""


def table(head, rows):
    """In Markdown, columns aligned."""
    cells = [head, *rows]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    def line(row):
        first, *rest = [cell.ljust(width) if column == 0 else cell.rjust(width)
                        for column, (cell, width) in enumerate(zip(row, widths))]
        return "| " + " | ".join([first, *rest]) + " |"
    rule = "|" + "|".join(["-" * (widths[0] + 2),
                           *["-" * (width + 1) + ":" for width in widths[1:]]]) + "|"
    return "\n".join([line(head), rule, *[line(row) for row in rows]])


def shown(number):
    """Three digits that count."""
    if number is None:
        return "-"
    if abs(number) >= 1000:
        return f"{number:,.0f}".replace(",", " ")
    if abs(number) >= 100:
        return f"{number:.0f}"
    return f"{number:.2f}" if abs(number) < 10 else f"{number:.1f}"


def time_shown(nanoseconds):
    for unit, size in (("s", 1e9), ("ms", 1e6), ("us", 1e3)):
        if nanoseconds >= size:
            return f"{shown(nanoseconds / size)} {unit}"
    return f"{shown(nanoseconds)} ns"


def micro_table(rows):
    lines = []
    for row in rows:
        lines.append([row["name"], time_shown(row["median_ns"]), f"{100 * row['spread']:.0f} %",
                      time_shown(row["ns_an_item"]) if "ns_an_item" in row else "-",
                      ", ".join(f"{key} {shown(value)}"
                                for key, value in row["counters"].items())])
    return table(["benchmark", "median", "spread", "a result", "counted"], lines)


def case_title(row):
    duration_us = row["duration_us"]
    time = f"{duration_us // 1000} ms" if duration_us >= 1000 else f"{duration_us} us"
    return time if row["mode"] == "burn" else f"{row['workers']}: {time}"


def matrix(rows, value):
    """A row a contestant, a column a case, in the order of the rows."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    titles = {row["case"]: case_title(row) for row in rows}
    cells = {(row["contestant"], row["case"]): value(row) for row in rows}
    return table(["contestant", *[titles[case] for case in cases]],
                 [[contestant, *[cells.get((contestant, case), "-") for case in cases]]
                  for contestant in dict.fromkeys(row["contestant"] for row in rows)])


def ratio_shown(row):
    low, high = row["ratio"]["min"], row["ratio"]["max"]
    return f"{row['ratio']['median']:.2f} ({low:.2f}-{high:.2f})"


def rate_shown(row):
    return shown(row["rate"]["median"])


def share_shown(row):
    return f"{row['share']['median']:.2f}" if "share" in row else "-"


def processor_time_shown(row):
    return " / ".join(shown(row[key]["median"]) for key in ("learner_us", "worker_us", "evaluator_us")
                      if key in row)


def wire_table(rows):
    channels = ("TREEROLL_ROLLOUTS", "TREEROLL_REWARDS")

    def results_a_message(row, channel):
        messages = row["messages_a_result"].get(channel, 0)
        return shown(1 / messages) if messages else "-"
    return table(
        ["case", "bytes a result", "of requests", "of answers", "results a request message",
         "results an answer message", "datagrams lost"],
        [[row["case"], shown(sum(row["bytes_a_result"].values())),
          *[shown(row["bytes_a_result"].get(channel, 0)) for channel in channels],
          *[results_a_message(row, channel) for channel in channels],
          str(row["datagrams_lost"])] for row in rows])


# How the part of a comparison is headed, and what its columns are.
PARTS = {
    "busy": ("Busy evaluators", "columns: a roll-out's processor time"),
    "asleep": ("Evaluators that wait", "columns: evaluators, a roll-out's time"),
    "one in flight": ("One in flight", "columns: a roll-out's processor time"),
    "keys": ("With keys", "columns: a roll-out's processor time"),
    "tcpq": ("tcpq beside multicast", "columns: a roll-out's processor time"),
}


def comparison(part, rows):
    title, columns = PARTS[part]
    texts = [f"### {title}",
             f"Roll-outs a second as a ratio to {rows[0]['ratio_to']} of the same round, median "
             f"(lowest-highest); {columns}:", matrix(rows, ratio_shown),
             "Roll-outs a second, median:", matrix(rows, rate_shown)]
    if any("share" in row for row in rows):
        texts += ["Share of all processor time that roll-outs take:", matrix(rows, share_shown)]
    return [*texts, "Processor time a result, us: learner or master / worker daemon, if there is "
            "one / evaluator beside what the roll-out burns:", matrix(rows, processor_time_shown)]


def report(measured):
    """Every figure as a section of a page."""
    machine = measured["machine"]
    loads = ", ".join(f"{load:.1f}" for load in machine["loads"])
    texts = ["## Figures",
             f"{machine['processors']} processors ({machine['processor']}), Linux "
             f"{machine['kernel']}, {machine['system']}. Load of the machine at the start, and after "
             f"the parts and each round: {loads}."]
    rounds = len(machine["loads"]) - 2
    if measured["comparison"]:
        texts.append(f"{rounds} rounds of the comparison." if rounds > 1 else
                     "One round of the comparison: no spread is known.")
    if measured["quick"]:
        texts.append("From `--quick`: no measure of anything.")
    for part in dict.fromkeys(row["part"] for row in measured["comparison"]):
        texts += comparison(part, [row for row in measured["comparison"] if row["part"] == part])
    if measured["wire"]:
        texts += ["### On the wire", wire_table(measured["wire"])]
    if measured["micro"]:
        texts += ["### Parts", "Processor time; spread is (highest - lowest) / median of "
                  f"{measured['micro_repetitions']} repetitions.", micro_table(measured["micro"])]
    if measured["skipped"]:
        texts += ["### Skipped", "\n".join(f"- {line}" for line in measured["skipped"])]
    return "\n\n".join(texts) + "\n"

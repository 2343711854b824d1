"""From graded cases to Markdown: shares with intervals, calibration, confusion."""
from collections import Counter

import numpy as np

Z90 = 1.645
TOLERANCE = 0.15  # of the gap, by the contract
NO_WORSE = 0.02  # of a channel's gap without any effects
STATED = (0.7, 1.4)  # squared difference over stated variance, by the contract
DEAREST = 20.0  # processor time of a diagnosis over that of a plain re-simulation, by the contract
BINS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0001)


def wilson(right, count):
    """The 90 % Wilson interval of a share."""
    if not count:
        return 0.0, 1.0
    share, z2 = right / count, Z90**2 / count
    centre, half = (share + z2 / 2) / (1 + z2), Z90 * np.sqrt(share * (1 - share) / count + z2 / (4 * count)) / (1 + z2)
    return max(0.0, centre - half), min(1.0, centre + half)


def _share(flags):
    flags = [bool(flag) for flag in flags if flag is not None]
    if not flags:
        return "–"
    low, high = wilson(sum(flags), len(flags))
    return f"{100 * np.mean(flags):.0f} % ({100 * low:.0f}–{100 * high:.0f})"


def _within(said, measured):
    if said is None or measured is None:
        return False  # a promise that is missing is not kept
    return abs(said - measured) <= TOLERANCE * measured


def _no_worse(said, nominal, channel):
    """Without an answer nothing is known of a channel; without its samples in either, nothing is judged."""
    if nominal[channel] is None:
        return None
    return bool(said and said[channel] is not None and said[channel] <= (1 + NO_WORSE) * nominal[channel])


def _honest(said, channel):
    ratio = (said or {}).get(f"{channel}_over_stated")
    return ratio is not None and STATED[0] <= ratio <= STATED[1]


def judge(record):
    """Adds the yes-or-no answers of one case."""
    places, affected = record["placements"], record["affected"]
    record["exact"] = all(place["present"] and place["hidden"] == place["named"] for place in places.values())
    record["contained"] = all(set(place["hidden"]) <= set(place["named"]) for place in places.values())
    record["false_alarms"] = sum(len(set(place["named"]) - set(place["hidden"])) for place in places.values())
    loud = [name for name, place in places.items() if place["named"]]
    record["right_place"] = loud == [affected] if affected else not loud
    for name, place in places.items():
        measured = place["measured"]
        said, true = measured.get("said"), measured.get("true")
        whole = bool(said and true and said["accel"] is not None and true["accel"] is not None)
        place["closed"] = {channel: whole and said[channel] <= (1 + TOLERANCE) * true[channel] for channel in ("accel", "gyro")} if true else {}
        nominal = measured.get("nominal")
        place["no_worse"] = {channel: _no_worse(said, nominal, channel) for channel in ("accel", "gyro")} if nominal else {}
        place["stated"] = {channel: _honest(said, channel) for channel in ("accel", "gyro")}
        after = (place["gap"] or {}).get("after") or {}
        place["kept"] = {channel: _within(after.get(f"{channel}_rmse"), said and said[channel]) for channel in ("accel", "gyro")}
    return record


def _judged(record):
    """The placements whose gap counts: the affected one, or all where nothing is hidden."""
    return [place for name, place in record["placements"].items() if record["affected"] in (None, name)]


def _all_of(answers):
    return None if not answers or None in answers.values() else all(answers.values())


def _stretch(seconds):
    return f"{np.median(seconds):.1f}, {np.max(seconds):.1f}" if seconds else "–"


def suites_table(records):
    lines = ["| suite | n | exact set | contained | cases with a false alarm | false alarms | right placement | gap ≤ 1.15 × true | failed | seconds / placement (median, max) |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for suite in sorted({record["suite"] for record in records}):
        own = [record for record in records if record["suite"] == suite]
        judged = [place for record in own for place in _judged(record)]
        seconds = [record["seconds"][0] for record in own if record["seconds"]]
        failed = sum("failed" in record or "errors" in record for record in own)
        lines.append(f"| {suite} | {len(own)} | {_share([r['exact'] for r in own])} | {_share([r['contained'] for r in own])} "
                     f"| {_share([r['false_alarms'] > 0 for r in own])} | {sum(r['false_alarms'] for r in own)} | {_share([r['right_place'] for r in own])} "
                     f"| {_share([_all_of(place['closed']) for place in judged])} | {failed} "
                     f"| {_stretch(seconds)} |")
    return lines


def promises_table(records):
    lines = ["| suite | accel promise within 15 % | gyro | both | accel said / measured (5, 50, 95 %) | gyro | 90 % intervals hold the truth | scalars |", "|---|---|---|---|---|---|---|---|"]
    for suite in sorted({record["suite"] for record in records}):
        places = [place for record in records if record["suite"] == suite for place in _judged(record)]
        ratios = []
        for channel in ("accel", "gyro"):
            pairs = [(((p["gap"] or {}).get("after") or {}).get(f"{channel}_rmse"), (p["measured"].get("said") or {}).get(channel)) for p in places]
            values = [said / measured for said, measured in pairs if said is not None and measured]
            ratios.append(" ".join(f"{x:.2f}" for x in np.quantile(values, (0.05, 0.5, 0.95))) if values else "–")
        inside = sum(item["inside"] for place in places for item in place["parameters"])
        scalars = sum(item["scalars"] for place in places for item in place["parameters"])
        lines.append(f"| {suite} | {_share([p['kept']['accel'] for p in places])} | {_share([p['kept']['gyro'] for p in places])} | {_share([_all_of(p['kept']) for p in places])} "
                     f"| {ratios[0]} | {ratios[1]} | {100 * inside / scalars if scalars else 0:.0f} % | {scalars} |")
    return lines


def _quantiles(values, digits=2):
    values = [value for value in values if value is not None]
    return " ".join(f"{x:.{digits}f}" for x in np.quantile(values, (0.05, 0.5, 0.95))) if values else "–"


def harm_table(records):
    """Whether anything gets worse, by every placement, whether affected or not."""
    lines = ["| suite | placements | accel no worse | gyro no worse | neither worse | worst accel | worst gyro |", "|---|---|---|---|---|---|---|"]
    for suite in sorted({record["suite"] for record in records}):
        places = [place for record in records if record["suite"] == suite for place in record["placements"].values()]
        worst = []
        for channel in ("accel", "gyro"):
            pairs = [(place["measured"].get("said") or {}, place["measured"].get("nominal") or {}) for place in places]
            ratios = [a[channel] / b[channel] for a, b in pairs if a.get(channel) is not None and b.get(channel)]
            worst.append(f"{max(ratios):.2f}" if ratios else "–")
        flags = [_share([place["no_worse"].get(channel) for place in places]) for channel in ("accel", "gyro")]
        lines.append(f"| {suite} | {len(places)} | {flags[0]} | {flags[1]} | {_share([_all_of(place['no_worse']) for place in places])} | {worst[0]} | {worst[1]} |")
    return lines


def stated_table(records):
    """Squared differences over stated variances on the check recordings, of the placements that are judged."""
    lines = [f"| suite | accel within {STATED[0]} to {STATED[1]} | gyro | both | accel (5, 50, 95 %) | gyro |", "|---|---|---|---|---|---|"]
    for suite in sorted({record["suite"] for record in records}):
        places = [place for record in records if record["suite"] == suite for place in _judged(record)]
        ratios = [_quantiles([(place["measured"].get("said") or {}).get(f"{channel}_over_stated") for place in places]) for channel in ("accel", "gyro")]
        flags = [_share([place["stated"][channel] for place in places]) for channel in ("accel", "gyro")]
        lines.append(f"| {suite} | {flags[0]} | {flags[1]} | {_share([_all_of(place['stated']) for place in places])} | {ratios[0]} | {ratios[1]} |")
    return lines


def cost_table(records):
    lines = [f"| suite | within {DEAREST:.0f} times | processor time over `simulate --reference` (5, 50, 95 %) | largest |", "|---|---|---|---|"]
    for suite in sorted({record["suite"] for record in records}):
        costs = [record["cost"] for record in records if record["suite"] == suite and record["cost"] is not None]
        if costs:
            lines.append(f"| {suite} | {_share([cost <= DEAREST for cost in costs])} | {_quantiles(costs, 1)} | {max(costs):.1f} |")
    return lines


def errors_table(records):
    lines = ["| parameter | n | median error | 90 % |", "|---|---|---|---|"]
    for effect, unit in (("time_offset", "ms"), ("lever_arm", "mm"), ("mount_rotation", "degrees")):
        errors = [item["error"] for r in records for place in r["placements"].values() for item in place["parameters"] if item["effect"] == effect and item["error"] is not None]
        if errors:
            lines.append(f"| {effect} [{unit}] | {len(errors)} | {np.median(errors):.3f} | {np.quantile(errors, 0.9):.3f} |")
    return lines


def coverage_table(records):
    """By effect: how often the 90 % interval holds the truth."""
    lines, tally = ["| effect | named rightly | scalars | inside 90 % |", "|---|---|---|---|"], {}
    for record in records:
        for place in record["placements"].values():
            for item in place["parameters"]:
                entry = tally.setdefault(item["effect"], [0, 0, 0])
                entry[0], entry[1], entry[2] = entry[0] + 1, entry[1] + item["scalars"], entry[2] + item["inside"]
    return lines + [f"| {effect} | {n} | {count} | {f'{100 * inside / count:.0f} %' if count else '–'} |" for effect, (n, count, inside) in sorted(tally.items())]


def reliability(said, right):
    """Bins, Brier score and expected calibration error of probabilities against outcomes."""
    lines, error = ["| said probability | mean said | right | n |", "|---|---|---|---|"], 0.0
    said, right = np.array(said, float), np.array(right, float)
    for low, high in zip(BINS, BINS[1:]):
        own = (said >= low) & (said < high)
        mean = f"{said[own].mean():.3f}" if own.any() else "–"
        lines.append(f"| {low:.2f}–{min(high, 1.0):.2f} | {mean} | {_share(right[own])} | {own.sum()} |")
        error += abs(said[own].sum() - right[own].sum()) / max(1, len(said))
    if len(said):
        brier, base = np.mean((said - right) ** 2), right.mean()
        lines += ["", f"Brier score {brier:.4f} ({base * (1 - base):.4f} for always saying {base:.3f}, the share that is right); "
                      f"expected calibration error {error:.4f} over these bins; {len(said)} causes."]
    return lines


def calibration_table(records):
    causes = [cause for r in records for place in r["placements"].values() for cause in place["causes"] if cause["probability"] is not None]
    lines = reliability(*([cause[key] for cause in causes] for key in ("probability", "right")))
    sums = [abs(place["share_sum"] - 1) for r in records for place in r["placements"].values() if place["share_sum"] is not None]
    if sums:
        lines += ["", f"Shares: |sum − 1| is {np.mean(sums):.4f} in the mean, {np.max(sums):.4f} at most, over {len(sums)} placements."]
    return lines


def strengths_table(records):
    """Single effects: exact answers of all, by strength."""
    names = sorted({effect for r in records for effect in r["strength"]})
    lines = ["| effect | weak exact | medium exact | strong exact | named at all |", "|---|---|---|---|---|"]
    for effect in names:
        own = [r for r in records if effect in r["strength"]]
        cells = []
        for strength in ("weak", "medium", "strong"):
            some = [r["exact"] for r in own if r["strength"][effect] == strength]
            cells.append(f"{sum(some)}/{len(some)}" if some else "")
        # outside and mechanics have names of their own for what is hidden
        places = [r["placements"][r["affected"]] for r in own if r["affected"]]
        found = [set(place["hidden"]) <= set(place["named"]) for place in places]
        lines.append(f"| {effect} | {' | '.join(cells)} | {sum(found)}/{len(found)} |")
    return lines


def confusion_table(records):
    lines, tally = ["| hidden | named | n | cases |", "|---|---|---|---|"], {}
    for record in records:
        for name, place in record["placements"].items():
            if place["hidden"] == place["named"]:
                continue
            hidden = ", ".join(f"{x} ({record['strength'][x]})" if x in record["strength"] else x for x in place["hidden"]) or "nothing"
            if record["suite"] == "outside" and place["hidden"]:
                hidden = "outside: " + ", ".join(f"{x} ({y})" for x, y in record["strength"].items())
            if "failed" in record:
                hidden += " [failed]"
            tally.setdefault((hidden, ", ".join(place["named"]) or "nothing"), []).append(record["case"])
    for (hidden, named), cases in sorted(tally.items(), key=lambda item: (-len(item[1]), item[0])):
        lines.append(f"| {hidden} | {named} | {len(cases)} | {' '.join(cases[:4])} |")
    return lines


def left_out_table(records):
    """Leave-one-out: what is said of an effect that the library was denied."""
    lines = ["| effect | n | `unknown` named | nothing else named |", "|---|---|---|---|"]
    for effect in sorted({r["without"] for r in records}) + [None]:
        own = [r for r in records if effect in (None, r["without"])]
        lines.append(f"| {effect or 'all'} | {len(own)} | {_share(['unknown' in r['named'] for r in own])} | {_share([r['named'] == ['unknown'] for r in own])} |")
    stand_ins = Counter((r["without"], ", ".join(r["named"]) or "nothing") for r in records if r["named"] != ["unknown"])
    lines += ["", "| left out | named | n |", "|---|---|---|"] + [f"| {a} | {b} | {n} |" for (a, b), n in stand_ins.most_common()]
    return lines


def report(records):
    parts = [("Suites", suites_table(records)), ("No channel worse", harm_table(records)), ("Promises and intervals", promises_table(records)),
             ("Squared differences over stated variances", stated_table(records)), ("Cost", cost_table(records)), ("Errors of parameters", errors_table(records)),
             ("Probabilities", calibration_table(records)), ("Intervals by effect", coverage_table(records))]
    for suite in ("single", "placement", "outside", "mechanics"):
        own = [r for r in records if r["suite"] == suite]
        if own:
            parts.append((f"By effect and strength: {suite}", strengths_table(own)))
    parts.append(("Wrong answers", confusion_table(records)))
    return "\n".join(line for title, lines in parts for line in [f"## {title}", *lines, ""])

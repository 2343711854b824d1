#!/usr/bin/env python3
"""Generate, diagnose, grade: the one command behind the README's table."""
import argparse
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import fifth_origin
import fourth_origin
import generate
import grade
import other_origin
import tables
import third_origin


def diagnose(cromosim, recordings, out, without=None):
    """One diagnosis of one recording or several; time.txt gets wall and processor seconds, log.txt what was printed."""
    os.makedirs(out, exist_ok=True)
    command = [cromosim, "diagnose", *recordings, "--out", out, "--force"] + (["--without", without] if without else [])
    with open(os.path.join(out, "log.txt"), "w") as log:
        begin = time.monotonic()
        child = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - begin
        log.write(f"\nexit {child.returncode}\n")
    with open(os.path.join(out, "time.txt"), "w") as stream:
        stream.write(f"{seconds:.3f} {usage.ru_utime + usage.ru_stime:.3f}\n")
    return child.returncode


def fits(out, case):
    return generate.recordings(os.path.join(out, case), "fit")


def progress(done, count, begin, what):
    screen = sys.stderr.isatty()
    if screen or done == count or done % max(1, count // 10) == 0:
        start, end = ("\r", "\n" if done == count else "") if screen else ("", "\n")
        print(f"{start}{what} {done}/{count}, {time.monotonic() - begin:.0f} s", end=end, file=sys.stderr, flush=True)


def many(jobs, work, what):
    begin, done = time.monotonic(), 0
    with ThreadPoolExecutor(jobs) as pool:
        for _ in pool.map(lambda step: step(), work):
            done += 1
            progress(done, len(work), begin, what)


def leave_one_out(options, out, labels, results):
    """Denies each single medium or strong effect to the library: `unknown` should take its place.
    The one mode in which the runner opens labels before the diagnosis: `--without` needs the name."""
    work, records = [], []
    for case in sorted(os.listdir(out)):
        label = generate.read_label(labels, case)
        (effect, strength), = label["strength"].items()
        if strength == "weak":
            continue
        folder = os.path.join(results, f"{case}-without")
        work.append(lambda case=case, folder=folder, effect=effect: diagnose(options.cromosim, fits(out, case), folder, effect))
        records.append({"case": case, "without": effect, "strength": strength, "affected": label["affected"], "folder": folder})
    many(options.jobs, work, "leave one out")
    for record in records:
        try:
            with open(os.path.join(record["folder"], "diagnosis.json")) as stream:
                causes = json.load(stream)["placements"][record["affected"]]["causes"]
            record["named"] = sorted(cause["effect"] for cause in causes)
        except (OSError, ValueError, KeyError):
            record["named"] = ["failed"]
    return records


def write_cases(options, out, suite):
    if suite == "mechanics":
        import mechanics  # MuJoCo is no requirement of the others
        return mechanics.generate(out, options.seed, options.count, options.jobs)
    if suite in other_origin.SUITES:
        return other_origin.generate(out, suite, options.seed, options.count, options.jobs)
    if suite in third_origin.SUITES:
        return third_origin.generate(out, suite, options.seed, options.count, options.jobs)
    if suite in fourth_origin.SUITES:
        return fourth_origin.generate(out, suite, options.seed, options.count, options.jobs)
    if suite in fifth_origin.SUITES:
        return fifth_origin.generate(out, suite, options.seed, options.count, options.jobs)
    return generate.generate(out, suite, options.seed, options.count, jobs=options.jobs, seconds=options.seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--suite", action="append", choices=[*generate.SUITES, *other_origin.SUITES, *third_origin.SUITES, *fourth_origin.SUITES, *fifth_origin.SUITES, "mechanics"],
                        help="may be repeated; default all but those of another origin, and mechanics, which needs MuJoCo")
    parser.add_argument("--count", type=int, help="cases of each suite; default the suite's own")
    parser.add_argument("--seconds", type=float, help="length of the fit recordings; default the suite's own")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cromosim", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--leave-one-out", action="store_true")
    parser.add_argument("--keep", action="store_true", help="use recordings that an earlier run has left in --out")
    options = parser.parse_args()
    options.cromosim = os.path.abspath(options.cromosim)
    suites = ["single"] if options.leave_one_out else options.suite or list(generate.SUITES)
    records = []
    for suite in suites:
        folder = suite + (f"-{options.seconds:.0f}" if options.seconds else "")
        out, results = os.path.join(options.out, folder), os.path.join(options.out, f"{folder}-results")
        labels = generate.labels_folder(out)
        if not (options.keep and os.path.isdir(out)):
            if os.path.isdir(out) and os.listdir(out):
                sys.exit(f"{out} is not empty: use --keep or another --out")
            begin = time.monotonic()
            write_cases(options, out, suite)
            print(f"generated {suite} in {time.monotonic() - begin:.0f} s", file=sys.stderr)
        if options.leave_one_out:
            records = leave_one_out(options, out, labels, results)
            continue
        work = [lambda case=case: diagnose(options.cromosim, fits(out, case), os.path.join(results, case)) for case in sorted(os.listdir(out))]
        many(options.jobs, work, f"diagnose {suite}")
        records += grade.grade(out, labels, results, options.cromosim, options.jobs)
    print("\n".join(["## Effect left out of the library", *tables.left_out_table(records)]) if options.leave_one_out else tables.report(records))
    with open(os.path.join(options.out, "leave_one_out.json" if options.leave_one_out else "grades.json"), "w") as stream:
        json.dump(records, stream, indent=1)


if __name__ == "__main__":
    main()

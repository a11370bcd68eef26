"""The parts of bench/run.py that train captures: rules, leave-one-out, curves and long.

Each --capture NAME DIR is trained by `gart train`; what is reported is read from the metrics.json, history.json and
model.ply that it leaves. Steps and Gaussians are those of --train, else the part's own.
"""
import hashlib
import json
import math
import os
import resource
import shlex
import shutil

from common import last_line, run

FULL_STEPS = 30000
# Gaussians at most, for captures that are known, where --train does not say.
GAUSSIANS = {"lego": 300000, "bonsai": 1000000, "tandt_train": 1000000, "fox": 500000, "many_cameras": 500000}

CURVE_STEPS, CURVE_WINDOW, CURVE_POINTS = 1000, 50, 100
# Method and number of the run; the two of `primitive` are the noise from run to run.
CURVE_RUNS = (("primitive", 1), ("primitive", 2), ("pixel", 1), ("hybrid", 1), ("deterministic", 1),
              ("deterministic", 2))
LONG_PARTS = ("finite", "seeds", "deterministic")

# Rules of training (docs/training.md): what each line changes of the defaults, by `gart train`.
RULES = (("all", []),
         ("drawn later: full at three quarters", ["--set", "error.growth_end=0.75"]),
         ("full at a quarter of the run", ["--set", "error.growth_end=0.25"]),
         ("no penalty on opacity", ["--set", "error.opacity_penalty=0"]),
         ("penalty x 3", ["--set", "error.opacity_penalty=0.009"]),
         ("children farther apart, q = 0.4", ["--set", "error.split.offset=0.4"]),
         ("children nearer, q = 0.25", ["--set", "error.split.offset=0.25"]),
         ("a Gaussian for 200 pixels", ["--set", "error.pixels_per_gaussian=200"]),
         ("nothing moves once the budget is full", ["--set", "error.until=0.5"]),
         ("rates of means x 2", ["--set", "rates.mean=1.6e-4,rates.mean_final=1.6e-6"]),
         ("rate of opacity x 2", ["--set", "rates.opacity=0.05"]),
         ("D-SSIM x 2", ["--set", "ssim_weight=0.4"]),
         ("a fifth left out of each step", ["--set", "dropout=0.2"]),
         ("dropout to the end", ["--set", "dropout_until=1"]),
         ("nothing against overfitting", ["--set", "dropout=0,ssim_weight=0.2,error.split.offset=0"]),
         ("images at full size from the start", ["--set", "resolution.quarter_until=0,resolution.half_until=0"]),
         ("smaller images in half of any run", ["--set", "resolution.long_run=1000000"]),
         ("bands one after the other", ["--set", "sh_every=1000"]),
         ("bands at a twentieth of the rate", ["--set", "rates.sh_rest=1.25e-4"]),
         ("nothing settles", ["--set", "rates.final_scale=1"]),
         ("rates of a long run in any", ["--set", "rates.long_run=1"]),
         ("start 0.5, 0.1", ["--init-opacity", "0.5", "--init-scale", "0.1"]),
         ("antialias", ["--antialias"]),
         ("mcmc", ["--densify", "mcmc"]),
         ("mcmc, no noise", ["--densify", "mcmc", "--set", "mcmc.noise=0"]),
         ("mcmc, no penalties", ["--densify", "mcmc", "--set",
                                  "mcmc.opacity_penalty=0,mcmc.scale_penalty=0"]),
         ("adc", ["--densify", "adc"]),
         ("adc, no resets", ["--densify", "adc", "--set", "adc.opacity_reset_every=0"]))


# What gart train chooses among (docs/training.md), as fixed settings: all combinations.
EXPOSURE, VIGNETTING = ["--exposure", "on"], ["--vignetting", "on"]
SETTINGS = (("usual", []), ("exposure", EXPOSURE), ("vignetting", VIGNETTING),
            ("exposure, vignetting", EXPOSURE + VIGNETTING), ("twentieth", ["--set", "rates.sh_rest=0.000125"]),
            ("pixels 100", ["--set", "error.pixels_per_gaussian=100"]), ("match", ["--match", "on"]))


def digest(data):
    return hashlib.sha256(data).hexdigest()


def read_json(path):
    with open(path) as f:
        return json.load(f)


def smoothed(points, window):
    """Points (step, mean since the point before), as means over `window` steps or the spacing, whichever is longer."""
    n = max(1, round(window / points[0][0])) if points else 1
    return [(points[i][0], sum(value for _, value in points[i + 1 - n:i + 1]) / n) for i in range(n - 1, len(points))]


def difference(curve, other, reference):
    """The largest and the mean |curve - other| / reference over the steps that all have."""
    other, reference = dict(other), dict(reference)
    shares = [abs(value - other[step]) / abs(reference[step]) for step, value in curve
              if step in other and reference.get(step)]
    return {"largest": max(shares), "mean": sum(shares) / len(shares)} if shares else None


def spread(values):
    """Mean, standard deviation (of the sample), least and most; None where a value is missing."""
    if not values or any(v is None for v in values):
        return None
    mean = sum(values) / len(values)
    squares = sum((v - mean) ** 2 for v in values)
    return {"mean": mean, "deviation": math.sqrt(squares / (len(values) - 1)) if len(values) > 1 else None,
            "least": min(values), "most": max(values)}


def same(rows, key):
    """Whether two rows agree; None where there are fewer."""
    return len({row[key] for row in rows}) == 1 if len(rows) > 1 else None


def left_out(runs):
    """A row a capture: its choices, the fixed setting that is best on all the others, and its own best."""
    scores = {}
    for r in runs:
        scores.setdefault(r["capture"], {}).setdefault(r["setting"], []).append(r["psnr"])
    scores = {c: {s: sum(v) / len(v) for s, v in of.items()} for c, of in scores.items()}
    rows = []
    for capture, of in scores.items():
        fixed = [s for s in of if not s.startswith("chosen")]
        tunable = [s for s in fixed if all(s in o for o in scores.values())]
        others = [o for c, o in scores.items() if c != capture]
        if "chosen" not in of or not tunable or not others:
            continue
        tuned = max(tunable, key=lambda s: sum(o[s] for o in others))
        best = max(fixed, key=lambda s: of[s])
        rows.append({"capture": capture, "chosen": of["chosen"], "usual": of.get("usual"),
                     "tuned_on_others": tuned, "tuned": of[tuned], "best": best, "best_psnr": of[best]})
    return rows


def summary_of(runs):
    """Of the runs of `long` on a capture: what the three parts came to, as far as they were run."""
    of = lambda part: [r for r in runs if r["part"] == part and "error" not in r]
    seeds, finite, twice = of("seeds"), of("finite"), of("deterministic")
    usual = spread([r["seconds"] for r in seeds])
    against = lambda rows: sum(r["seconds"] for r in rows) / len(rows) / usual["mean"] if usual and rows else None
    scores = {key: spread([r[key] for r in seeds]) for key in ("psnr", "ssim", "seconds")}
    return {"seeds": {"runs": len(seeds), **scores},
            "finite": {"runs": len(finite), "time_against_seeds": against(finite)},
            "deterministic": {"runs": len(twice), "same_model": same(twice, "model_sha256"),
                              "same_losses": same(twice, "losses_sha256"), "time_against_seeds": against(twice)}}


class Trainings:
    """A base of run.py's Bench, which has the programs, the folders and the arguments."""

    def train_options(self, name, steps=FULL_STEPS):
        """Those of --train and, where it is silent, the number of steps and of Gaussians."""
        words = shlex.split(self.a.train)
        given = {word.split("=")[0] for word in words}
        if "--iterations" not in given:
            words += ["--iterations", str(steps)]
        if "--max-gaussians" not in given and name in GAUSSIANS:
            words += ["--max-gaussians", str(GAUSSIANS[name])]
        return shlex.join(words)

    def train(self, label, capture, options, *more):
        """(folder, metrics, seconds of processors) of a training, or (None, why not, None); a failure is told."""
        folder = os.path.join(self.temporary, "run")
        shutil.rmtree(folder, ignore_errors=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = run([self.program("gart"), "train", capture, "--out", folder, "--backend", self.a.backend, "--quiet",
                    *more, *shlex.split(options)])
        if done.returncode != 0:
            self.fail(f"{label}: {last_line(done.stderr)}")
            return None, last_line(done.stderr), None
        return (folder, read_json(os.path.join(folder, "metrics.json")),
                resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)

    def rules(self):
        kept = ("psnr", "ssim", "psnr_affine_colour", "seconds", "gaussians", "iterations", "peak_bytes", "exposure")
        for name, capture in self.a.capture:
            runs, options = [], self.train_options(name)
            for rule, change in RULES:
                if self.a.rules and not rule.startswith(tuple(self.a.rules)):
                    continue
                rows = []
                for seed in range(1, (self.a.seeds or 3) + 1):
                    folder, metrics, _ = self.train(f"{name}, {rule}, seed {seed}", capture, options, "--no-auto",
                                                    "--seed", str(seed), *change)
                    if folder:
                        rows.append({"rule": rule, "change": change, "seed": seed,
                                     "training_psnr": metrics["training_scores"]["psnr"],
                                     **{key: metrics[key] for key in kept}})
                runs += rows
                scores = spread([r["psnr"] for r in rows])
                if scores:
                    self.say(f"{name}, {rule}: {scores['mean']:.2f} dB of {len(rows)} seeds")
                self.write("rules_" + name, runs, scene=name, train=options)

    def leave_one_out(self):
        """Every capture by the choices of `gart train` and by each fixed setting. What a fixed setting tuned on all
        captures but one gives on that one stands against the choices, and so does its own best."""
        kept = ("psnr", "ssim", "test_views", "seconds", "wall_seconds", "gaussians", "peak_bytes", "split", "measured",
                "image_size", "train_views", "iterations")
        runs = []
        for name, capture in self.a.capture:
            for setting, options in [("chosen", ["--auto"])] + [(n, ["--no-auto", *o]) for n, o in SETTINGS]:
                for seed in range(1, (self.a.seeds or 1) + 1):
                    folder, metrics, _ = self.train(f"{name}, {setting}", capture, self.train_options(name), *options,
                                                    "--seed", str(seed), "--eval-every", "0")
                    if folder:
                        runs.append({"capture": name, "setting": setting, "seed": seed,
                                     "options": self.train_options(name), **{k: metrics[k] for k in kept}})
                        self.say(f"{name}, {setting}, seed {seed}: {metrics['psnr']:.2f} dB")
                    self.write("leave_one_out", runs, summary=left_out(runs))

    def training(self, label, capture, options, *more):
        """A row of curves or long: scores, and what tells two runs apart; besides it the points (step, loss)."""
        folder, metrics, _ = self.train(label, capture, options, "--no-auto", "--eval-every", 0,
                                        "--checkpoint-every", 0, *more)
        if not folder:
            return {"error": metrics}, []
        history = read_json(os.path.join(folder, "history.json"))
        at = [history["train_columns"].index(key) for key in ("step", "loss", "psnr", "gaussians")]
        course = [[row[i] for i in at] for row in history["train"]]
        with open(os.path.join(folder, "model.ply"), "rb") as f:
            model = digest(f.read())
        kept = ("psnr", "ssim", "seconds", "iterations", "gaussians", "test_views", "image_size", "backend", "tracer",
                "backward", "finite_steps", "skipped_updates", "profiled_step_ms", "peak_bytes")
        row = {**{key: metrics[key] for key in kept if key in metrics}, "model_sha256": model,
               "losses_sha256": digest(json.dumps(course).encode())}
        scores = f"{row['psnr']:.2f} dB, " if row["psnr"] is not None else ""
        self.say(f"{label}: {scores}{row['seconds']:.1f} s")
        return row, [(step, loss) for step, loss, *_ in course if loss is not None]

    def captures_before(self, what):
        """The entries of OUT/WHAT.json, by capture."""
        path = os.path.join(self.a.out, what + ".json")
        return {entry["capture"]: entry for entry in read_json(path)["runs"]} if os.path.exists(path) else {}

    def curves(self):
        for name, capture in self.a.capture:
            options, rows, courses = self.train_options(name, CURVE_STEPS), [], {}
            for method, number in CURVE_RUNS:
                row, course = self.training(f"{name}, {method}, run {number}", capture, options,
                                            "--backward", method, "--seed", 1)
                if course:
                    courses[method, number] = smoothed(course, CURVE_WINDOW)
                rows.append({"method": method, "run": number, **row})
            first, second = (courses.get(("primitive", n), []) for n in (1, 2))
            mean = [(step, (value + dict(second)[step]) / 2) for step, value in first if step in dict(second)]
            for row in rows:
                course = courses.get((row["method"], row["run"]), [])
                every = max(1, math.ceil(len(course) / CURVE_POINTS))
                row["difference"] = difference(course, mean, mean)
                row["curve"] = [[step, float(f"{value:.6g}")] for step, value in course[::-1][::every][::-1]]
            twice = [r for r in rows if r["method"] == "deterministic" and "error" not in r]
            bits = {"same_model": same(twice, "model_sha256"), "same_losses": same(twice, "losses_sha256")}
            if False in bits.values():
                self.fail(f"{name}: two deterministic runs differ: {bits}")
            entries = {**self.captures_before("curves"),
                       name: {"capture": name, **self.stamp(), "options": options, "window": CURVE_WINDOW,
                              "noise": difference(first, second, mean), "deterministic": bits, "runs": rows}}
            self.write("curves", list(entries.values()))

    def long_before(self, name, settings):
        """What there is of a measurement that was broken off, of the same settings; else an empty one."""
        entry = self.captures_before("long").get(name)
        if entry:
            other = [key for key, value in settings.items() if entry.get(key) != value]
            if not other and settings["commit"] != "unknown" and not settings["commit"].endswith("with changes"):
                return entry
            why = "of another " + " and ".join(other) if other else "of a commit that is not known"
            self.say(f"{name}: the runs in long.json are {why}, and give way")
        return {"capture": name, **settings, "runs": []}

    def long(self):
        wanted = {"finite": [("finite", 1, 1, ["--check-finite"])],
                  "seeds": [("seeds", seed, 1, []) for seed in range(1, (self.a.seeds or 5) + 1)],
                  "deterministic": [("deterministic", 1, n, ["--backward", "deterministic"]) for n in (1, 2)]}
        for name, capture in self.a.capture:
            options = self.train_options(name)
            entry = self.long_before(name, {"options": options, "backend": self.a.backend, "commit": self.commit,
                                            "machine": self.machine})
            for part, seed, number, more in [row for part in self.a.long for row in wanted[part]]:
                label = f"{name}, {part}, seed {seed}, run {number}"
                key = {"part": part, "seed": seed, "run": number}
                before = [r for r in entry["runs"] if key.items() <= r.items()]
                if before and "error" not in before[0]:
                    self.say(f"{label}: measured before, {before[0]['date']}")
                    continue
                row, _ = self.training(label, capture, options, "--seed", seed, *more)
                if part == "finite" and row.get("finite_steps") != row.get("iterations"):
                    self.fail(f"{label}: {row['finite_steps']} of {row['iterations']} steps were checked")
                date = self.stamp()["date"]
                entry["runs"] = [r for r in entry["runs"] if r not in before] + [{**key, "date": date, **row}]
                entry.update(date=date, summary=summary_of(entry["runs"]))
                self.write("long", list({**self.captures_before("long"), name: entry}.values()))
            bits = summary_of(entry["runs"])["deterministic"]
            if False in (bits["same_model"], bits["same_losses"]):
                self.fail(f"{name}: two deterministic runs differ: {bits}")

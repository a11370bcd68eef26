"""What bench/plot.py draws of the trainings of bench/training.py: leave-one-out, curves and long."""

from charts import courses
from tables import source, table


def shown(value, form):
    """A number in a format, or nothing where it was not measured."""
    return format(value, form) if value is not None else ""


def share(value):
    return f"{100 * value:.2g}%"


def reason(error):
    """The first clause of an error, for a cell of a table."""
    return error.split(";")[0].replace("|", "\\|")


def bits(both):
    """What two runs of `deterministic` came to, in words."""
    if both["same_model"] is None:
        return ""
    if both["same_model"] and both["same_losses"]:
        return "the same bits twice, model and losses"
    return f"**not the same bits twice**: model {both['same_model']}, losses {both['same_losses']}"


def mean_and_spread(values, form):
    if not values:
        return ""
    deviation = f" +- {values['deviation']:{form}}" if values["deviation"] is not None else ""
    return f"{values['mean']:{form}}{deviation} ({values['least']:{form}} to {values['most']:{form}})"


class TrainingPages:
    """A base of plot.py's Pages, which loads results and writes tables."""

    def cutoffs(self):
        result = self.load("cutoffs")
        if not result:
            return
        order = lambda r: (r["capture"], r["alpha_min"], r["t_min"], r["arithmetic"], r["lt_format"])
        rows = [[r["capture"], f"{r['alpha_min']:.3g}", f"{r['t_min']:.3g}",
                 ", ".join(x for x in (r["arithmetic"], r["lt_format"]) if x not in ("exact", "float4")),
                 f"{r['psnr']:.2f}", f"{r['ssim']:.4f}", shown(r["seconds"], ".0f")]
                for r in sorted(result["runs"], key=order)]
        self.tables["cutoffs"] = table(["capture", "alpha_min", "t_min", "besides", "trained PSNR, dB", "SSIM",
                                        "training, s"], rows) + ["", f"7,000 steps; {source(result)}."]

    def leave_one_out(self):
        result = self.load("leave_one_out")
        if not result:
            return
        scores, names = {}, []
        for r in result["runs"]:
            scores.setdefault(r["capture"], {}).setdefault(r["setting"], []).append(r["psnr"])
            if r["setting"] not in names and r["setting"] != "chosen":
                names.append(r["setting"])
        tuned = {r["capture"]: r["tuned"] for r in result["summary"]}
        rows = []
        for capture, of in scores.items():
            means = {setting: sum(values) / len(values) for setting, values in of.items()}
            rows.append([capture, means["chosen"], tuned[capture]] + [means[n] for n in names])
        average = ["mean"] + [sum(column) / len(rows) for column in list(zip(*rows))[1:]]
        cells = []
        for row in rows:
            best = max(row[3:])
            cells.append([row[0]] + [f"{v:.2f}" for v in row[1:3]] +
                         [f"**{v:.2f}**" if v == best else f"{v:.2f}" for v in row[3:]])
        cells.append([average[0]] + [f"{v:.2f}" for v in average[1:]])
        short = [n.replace("exposure", "E").replace("vignetting", "V").replace("bands", "B").replace(", ", " ") for n in names]
        self.tables["leave_one_out"] = table(["capture", "as chosen", "tuned on the others"] + short, cells)

    def curves(self):
        result = self.load("curves")
        if not result:
            return
        panels, rows, notes = [], [], []
        for entry in result["runs"]:
            name, runs, noise = entry["capture"], entry["runs"], entry["noise"]
            good = [r for r in runs if "error" not in r]
            # The one with the widest line first: what the others lie on.
            series = [(r["strategy"], r["curve"]) for r in good if r["run"] == 1 and r["curve"]]
            if series:
                panels.append((name, series, source(entry)))
            for r in runs:
                label = r["strategy"] + (", again" if r["run"] == 2 else "")
                if "error" in r:
                    rows.append([name, label, "failed", "", "", "", reason(r["error"])])
                    continue
                said, apart = "", r["difference"]
                if r["strategy"] == "primitive":
                    apart = None  # they are the mean that the others are compared with
                    if r["run"] == 2 and noise:
                        said = "the two runs of `primitive` against each other"
                        apart = noise
                if r["strategy"] == "deterministic" and r["run"] == 2:
                    said = bits(entry["deterministic"])
                end = r["curve"][-1][1] if r["curve"] else None
                rows.append([name, label, shown(r["psnr"], ".2f"), shown(end, ".4g"),
                             share(apart["largest"]) if apart else "", share(apart["mean"]) if apart else "", said])
            first = good[0] if good else {}
            notes += ["", f"{name}: {first.get('image_size', '')}, {entry['options']}, {first.get('backend', '')}; "
                          f"means over {entry['window']} steps; {source(entry)}."]
        rows = table(["capture", "strategy", "test PSNR, dB", "loss at the end", "largest difference",
                      "mean difference", ""], rows)
        if panels:
            courses(self.figure("curves"), "Loss by strategy", "training loss", panels)
            rows = ["![Loss by strategy](figures/curves.svg)", ""] + rows
        self.tables["curves"] = rows + notes

    def long(self):
        result = self.load("long")
        if not result:
            return
        rows, notes = [], []
        for entry in result["runs"]:
            name, summary = entry["capture"], entry["summary"]
            seeds = summary["seeds"]
            if seeds["runs"]:
                rows.append([name, f"{seeds['runs']} seeds", mean_and_spread(seeds["psnr"], ".2f"),
                             mean_and_spread(seeds["ssim"], ".4f"), mean_and_spread(seeds["seconds"], ".1f"), ""])
            for r in entry["runs"]:
                if r["part"] == "seeds" and "error" not in r:
                    continue
                label = {"finite": "every step checked", "deterministic": f"deterministic, run {r['run']}"}.get(
                    r["part"], f"seed {r['seed']}")
                if "error" in r:
                    rows.append([name, label, "failed", "", "", reason(r["error"])])
                    continue
                against = summary[r["part"]]["time_against_seeds"]
                said = [f"{against:.2f} times the seconds of the seeds"] if against else []
                if r["part"] == "finite":
                    said = [f"{r['finite_steps']:,} of {r['iterations']:,} steps finite, "
                            f"{r['skipped_updates']:,} updates left out"] + said
                elif r["run"] == 2:
                    said = [bits(summary["deterministic"])] + said
                else:
                    said = []
                rows.append([name, label, shown(r["psnr"], ".2f"), shown(r["ssim"], ".4f"), f"{r['seconds']:.1f}",
                             "; ".join(text for text in said if text)])
            first = next((r for r in entry["runs"] if "error" not in r), {})
            notes += ["", f"{name}: {first.get('image_size', '')}, {entry['options']}, {first.get('backend', '')}, "
                          f"{first.get('gaussians', 0):,} Gaussians at the end; {source(entry)}."]
        self.tables["long"] = table(["capture", "runs", "PSNR, dB", "SSIM", "training, s", ""], rows) + notes

"""Tables of the pages in docs, and where their figures come from."""


def table(header, rows):
    out = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return out + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def clock_of(tradeoff):
    return "processor_ms" if tradeoff["clock"] == "processor" else "total_ms"


def source(result):
    machine = result["machine"]
    return f"{machine.get('gpu', machine['cpu'])}, commit {result['commit']}, {result['date']}"

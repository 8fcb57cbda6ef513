"""What -log_view counted, per event: times and reductions of the slowest rank, operations, messages and bytes of all
ranks together.
"""
import csv

NOTHING = {"count": 0, "seconds": 0.0, "flops": 0.0, "messages": 0.0, "bytes": 0.0, "reductions": 0.0}


def read(path):
    events = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file, skipinitialspace=True):
            row = {(key or "").strip(): value for key, value in row.items()}
            event = events.setdefault(row["Event Name"].strip(), dict(NOTHING))
            event["count"] = max(event["count"], int(row["Count"]))
            event["seconds"] = max(event["seconds"], float(row["Time"]))
            event["flops"] += float(row["FLOP"])
            # PETSc counts a message where it is sent and where it is received
            event["messages"] += float(row["Num Messages"]) / 2
            event["bytes"] += float(row["Message Length"]) / 2
            event["reductions"] = max(event["reductions"], float(row["Num Reductions"]))
    return events


def get(events, name, key):
    return events.get(name, NOTHING)[key]

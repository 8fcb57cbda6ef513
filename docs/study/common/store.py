"""Measurements in CSV files: a row that is measured again takes the place of the old one, and none is lost when a run
is interrupted.
"""
import csv
import os

from . import measured


class Store:
    def __init__(self, path, key):
        """key: the columns that tell one measurement from another."""
        self.path, self.key, self.rows = path, key, []
        if measured.begun(path):
            with open(path, newline="") as file:
                self.rows = list(csv.DictReader(file))

    def name(self, row):
        return tuple(str(row[column]) for column in self.key)

    def has(self, row):
        return self.name(row) in [self.name(other) for other in self.rows]

    def put(self, row):
        row = {column: "" if value is None else str(value) for column, value in row.items()}
        for i, other in enumerate(self.rows):
            if self.name(other) == self.name(row):
                self.rows[i] = row
                break
        else:
            self.rows.append(row)
        columns = list(dict.fromkeys(column for each in self.rows for column in each))
        os.makedirs(os.path.dirname(self.path), exist_ok=True)
        with open(self.path, "w", newline="") as file:
            table = csv.DictWriter(file, columns, restval="", lineterminator="\n")
            table.writeheader()
            table.writerows(self.rows)

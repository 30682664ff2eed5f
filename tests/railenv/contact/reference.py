"""Reference data of CONTACT, and the patches that they belong to."""

import csv
from pathlib import Path

from railenv.contact.patch import ContactPatch

DATA = Path(__file__).resolve().parents[2] / "data" / "contact"

SPIN_CASE = ContactPatch(8e-3, 4e-3, 82e3, 0.3)
CURVES = ContactPatch(6.304e-3, 12.61e-3, 106.7e3, 0.33)
COACH_WHEEL = ContactPatch.of_wheel(55.9e3, 0.4575, 0.3, 0.2)


def rows(name):
    with (DATA / name).open(newline="") as stream:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(stream)]

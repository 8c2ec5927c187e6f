#!/usr/bin/env python3
"""Cells of the table of changed objects, over results of `unimapper evaluate changes`."""
import json
import sys

results = []
for path in sys.argv[1:]:
    with open(path, encoding="utf-8") as file:
        results.append(json.load(file))


def total(key):
    return sum(result[key] for result in results)


def percent(part, whole):
    return f"{100 * part / whole:.0f} %" if whole else "-"


changed = total("right") + total("replaced") + total("parts")
wrong = sum(len(result["wrong"]) for result in results)
recall = percent(total("vehicles_found"), total("vehicles_changed"))
print(f'{total("vehicles_found")} of {total("vehicles_changed")} ({recall}) | {total("found")} | '
      f'{total("right")} | {total("replaced")} | {total("parts")} | {total("stood")} | {wrong} | '
      f'{percent(changed, changed + wrong)}', end="")

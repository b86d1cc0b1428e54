#!/usr/bin/python3
"""tally.py FOLDER: adds up the results that ./check left in FOLDER.

*.xml are JUnit files of ctest and pytest; *.txt hold lines "PASS name",
"FAIL name" and "SKIP name: reason". Prints failures and skips, and as the last
line "N passed, N failed, N skipped". Exit status 1 if anything failed.
"""
import pathlib
import sys
import xml.etree.ElementTree as ET


def read_xml(path):
    for case in ET.parse(path).getroot().iter("testcase"):
        name = ": ".join(x for x in (path.stem, case.get("classname", ""), case.get("name")) if x)
        skipped = case.find("skipped")
        if case.find("failure") is not None or case.find("error") is not None:
            yield "FAIL", name, ""
        elif skipped is not None or case.get("status") == "disabled":
            reason = skipped.get("message", "") if skipped is not None else "disabled"
            yield "SKIP", name, reason
        else:
            yield "PASS", name, ""


def read_txt(path):
    for line in path.read_text().splitlines():
        verdict, _, rest = line.partition(" ")
        name, _, reason = rest.partition(": ")
        yield verdict, f"{path.stem}: {name}", reason


def main():
    counts = {"PASS": 0, "FAIL": 0, "SKIP": 0}
    for path in sorted(pathlib.Path(sys.argv[1]).glob("*.*")):
        read = {".xml": read_xml, ".txt": read_txt}.get(path.suffix)
        for verdict, name, reason in read(path) if read else ():
            counts[verdict] += 1
            if verdict == "FAIL":
                print(f"failed   {name}")
            elif verdict == "SKIP":
                print(f"skipped  {name}: {reason}")
    print(f"{counts['PASS']} passed, {counts['FAIL']} failed, {counts['SKIP']} skipped")
    return 1 if counts["FAIL"] or not counts["PASS"] else 0


if __name__ == "__main__":
    sys.exit(main())

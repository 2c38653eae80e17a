"""What tests counted, for scripts/trust: a line of JSON each, in the file that SHM_EVIDENCE names, if it does."""
import json
import os


def tell(what, **numbers):
    path = os.environ.get("SHM_EVIDENCE")
    if path:
        with open(path, "a", encoding="utf-8") as out:
            out.write(json.dumps({"what": what, **numbers}) + "\n")

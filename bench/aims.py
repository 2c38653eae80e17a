"""Makes the table "acceptance" of bench/values: compares the measured compressed sizes with target sizes (aims).

All figures are bits per vertex for coordinates, and bits per value for fields. The aims are the results of a throw-away
prototype of the same design. Each aim is a pair of figures. The first is the result of the prototype's faster mode,
which the default level should reach. The second is the best result of all experiments with the prototype, which level
best should reach. The prototype was measured on the corpus, and on generated meshes of the same kinds as those of
bench/values (not always of the same size).
"""

# The exact annulus mesh on which the prototype was measured is not known. All layers of that mesh must have been
# identical, because zstd found repetitions.
PROTOTYPE_MADE = {
    ("coordinates", "grid 15^3", "float32"): (.25, .15),
    ("coordinates", "straight annulus", "float32"): (.18, .07),
    ("coordinates", "straight annulus", "float64"): (.28, .16),
    ("coordinates", "sphere shell", "float32"): (2.5, 2.1),
    ("coordinates", "sphere shell", "float64"): (9.1, 7.7),
    ("coordinates", "warped block", "float32"): (5, 4.5),  # rounded up from the 4.8 bits of the prototype
    ("coordinates", "warped block", "float64"): (8.1, 7.3),
    ("coordinates", "warped block", "8 digits"): (5.3, 5.1),
    ("coordinates", "tets split in 4", "float32"): (10, 6.7),
    ("coordinates", "tets split in 4", "float64"): (52, 48),
    ("fields", "cell smooth", "float32"): (6.1, 4.4),
    ("fields", "cell velocity", "float32"): (8.7, 7.2),
    ("fields", "cell turbulence", "float32"): (23, 23),
    ("lossy", "cell velocity", "float32, 0.0001"): (1.28, 1),
    ("lossy", "cell turbulence", "float32, 0.0001"): (7.67, 7.67),
}
# Bits per value, averaged over all time steps. The table of the prototype's results has a column for each compressor;
# these figures are from the column with the smallest sizes (for integers, from the column for zstd).
PROTOTYPE_REAL = {"coordinates float64": 22, "coordinates float32": 21.4, "cell floats": 8.7,
                  "point floats": 17.4, "cell ints": .04, "point ints": .13}
ROUNDED_KIND, ROUNDED_AIM = "coordinates, 16 bits", 8.5
LOSSY_FIELDS, LOSSY_FACTOR = ("smooth", "velocity"), 1.5


def bits_of(rows, coder):
    """Returns the mean bits per value of a coder in `rows`. Returns None if the coder has no row for one of the
    subjects."""
    its = [row for row in rows if row["coder"] == coder]
    if not its or len(its) < len({row["subject"] for row in rows}):
        return None
    return sum(row["bits"] * row["values"] for row in its) / sum(row["values"] for row in its)


def best_other(rows):
    """Returns (bits, name) of the best compressor other than shm: the one with the smallest mean bits per value in
    `rows`."""
    others = {row["coder"] for row in rows if not row["coder"].startswith("shm")}
    return min((bits_of(rows, coder), coder) for coder in others
               if bits_of(rows, coder) is not None)


def line(what, level, rows, aim, source, strictly=False):
    """Returns the cells of one row of the table: name, aim, shm's result, and whether shm meets the aim."""
    ours = bits_of(rows, f"shm {level}")
    if ours is None:
        return [f"{what}, {level}", f"{aim:.2f} ({source})", "-", "no"]
    met = ours < aim if strictly else round(ours, 2) <= aim
    return [f"{what}, {level}", f"{'below ' if strictly else ''}{aim:.2f} ({source})",
            f"{ours:.2f}", "yes" if met else "no"]


def made(rows):
    for (table, subject, kind), aims in PROTOTYPE_MADE.items():
        its = [row for row in rows if row["table"] == table
               and row["subject"].startswith(subject) and row["subject"].endswith(f", {kind}")]
        if its:
            for level, aim in zip(("default", "best"), aims):
                yield line(f"{its[0]['table']}: {its[0]['subject']}", level, its, aim, "prototype")


def real(rows):
    for kind, aim in PROTOTYPE_REAL.items():
        its = [row for row in rows if row["table"] == "real"
               and row["group"] in (kind, f"{kind} steps")]
        if its:
            yield line(f"real: {kind}", "default", its, *best_other(its), strictly=True)
            yield line(f"real: {kind}", "best", its, aim, "prototype")
    its = [row for row in rows if row["table"] == "real" and row["group"] == ROUNDED_KIND]
    if its:
        yield line(f"real: {ROUNDED_KIND}", "default", its, ROUNDED_AIM, "aim")


def lossy(rows):
    for subject in dict.fromkeys(row["subject"] for row in rows if row["table"] == "lossy"):
        its = [row for row in rows if row["table"] == "lossy" and row["subject"] == subject]
        ours = bits_of(its, "shm default")
        if ours and any(f"cell {name}," in subject for name in LOSSY_FIELDS):
            other, name = best_other(its)
            yield [f"lossy: {subject}, size at level default", f"at least {LOSSY_FACTOR} times smaller than {name}",
                   f"{other / ours:.2f} times smaller", "yes" if other >= LOSSY_FACTOR * ours else "no"]


def acceptance(rows):
    """Returns all rows of the table "acceptance" for which `rows` contains data."""
    return [*made(rows), *lossy(rows), *real(rows)]

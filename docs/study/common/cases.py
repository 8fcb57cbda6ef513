"""The systems and the solver configurations of the stability study."""

PMATS = ("auto", "jcb", "id", "cc", "cg", "bj_cc", "bj_cg")
ROTATIONS = ("", "20,35,50", "45,0,0", "5,5,5")


def configurations(max_it):
    """Name, which system, options of the plugin."""
    limit = " -ainsworth_ksp_max_it %d" % max_it
    answer = [
        {"name": "alone", "system": "alone", "options": limit},
        {"name": "alone, same x", "system": "alone, same x", "options": limit},
    ]
    for variant in ("weighted", "paper"):
        for pmat in PMATS if variant == "weighted" else PMATS[1:]:
            answer.append({"name": variant + " " + pmat, "system": "constrained",
                           "options": "-pc_ainsworth_variant %s -pc_ainsworth_pmat %s" % (variant, pmat) + limit})
    return answer


def cases(n1, n2, quick):
    """(parameter, value, further options of twocubes), one parameter at a time around the base; quick: the ends and the
    middle.
    """
    answer = []

    def add(parameter, values):
        for i, (value, options) in enumerate(values):
            if not quick or len(values) <= 3 or i in (0, len(values) // 2, len(values) - 1):
                answer.append((parameter, value, options))

    size = max(n1 * 5 // 40 * 10, 10)
    add("E2/E1", [("1e%d" % e, "-E2 1e%d" % e) for e in (-6, -4, -3, -2, -1, 0, 1, 2, 3, 4, 6)])
    add("Poisson's ratio",
        [(nu, "-nu1 %s -nu2 %s" % (nu, nu)) for nu in ("0", "0.3", "0.45", "0.49", "0.499", "0.4999")])
    for stick in ("0", "0.5", "1"):
        add("rotation, stick " + stick,
            [(turn or "none", ("-rotate %s " % turn if turn else "") + "-stick " + stick) for turn in ROTATIONS])
    curved = ("0", "0.05", "0.15", "0.25")
    add("curvature", [(c, "-curved " + c) for c in curved])
    add("curvature, turned by 20,35,50", [(c, "-rotate 20,35,50 -curved " + c) for c in curved])
    ratios = [(size // 2, size), (size * 9 // 10, size), (size, size), (size, size * 9 // 10), (size, size // 2)]
    add("mesh ratio n1/n2", [("%.3g" % (a / b), "-n1 %d -n2 %d" % (a, b)) for a, b in ratios])
    shapes = [("height 0.25", "-height 0.25"), ("height 1", ""), ("height 4", "-height 4")]
    add("shape", shapes)
    elements = [("flat 4:1", "-height 0.25 -nz1 %d -nz2 %d" % (n1, n2)), ("cubic", ""),
                ("tall 4:1", "-nz1 %d -nz2 %d" % (max(n1 // 4, 1), max(n2 // 4, 1)))]
    add("shape of the elements", elements)
    add("row scaling, decades", [(s, "-rowscale " + s) for s in ("0", "1", "2", "4")])
    add("share that sticks", [(s, "-stick " + s) for s in ("0", "0.25", "0.5", "0.75", "1")])
    add("floating upper body, share that sticks", [(s, "-floating -stick " + s) for s in ("0.1", "0.5", "1")])
    return answer


def system(n1, n2, options):
    """All the options of twocubes; a later one wins, and equal systems get equal strings."""
    values = {"n1": n1, "n2": n2, "E2": "10", "nu1": "0.3", "nu2": "0.3", "stick": "0.5"}
    words = options.split()
    while words:
        key = words.pop(0)[1:]
        values[key] = "" if not words or (words[0].startswith("-") and words[0][1:2].isalpha()) else words.pop(0)
    if float(values["E2"]) == 10:
        values["E2"] = "10"
    for key in ("curved", "rowscale"):
        if values.get(key) == "0":
            del values[key]
    return " ".join(("-%s %s" % (key, values[key])).strip() for key in sorted(values))

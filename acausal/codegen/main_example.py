"""A small program that runs the exported model and prints its outputs."""

from .model import CModel

SHOWN = 6  # number of outputs that the example prints

EXAMPLE = """/* Prints outputs of NAME every 100 steps. Compile with: cc -O2 -std=c99 main.c NAME.c -lm */
#include "NAME.h"
#include <stdio.h>

int main(void)
{
    static NAME m;
    double y[NAME_N_Y + 1];
    NAME_start(&m);
    /* Here is the place to set parameters and start values, such as m.p[NAME_P_...] = 1.0; */
    if (NAME_violation(&m)) {
        printf("%s\\n", NAME_violation(&m));
        return 1;
    }
INITIALISE    for (int step = 0; step <= 1000; step++) {
        if (step % 100 == 0) {
            NAME_outputs(&m, y);
            printf(FORMAT);
        }
        if (NAME_step(&m) < 0)
            return 1;
    }
    return 0;
}
"""


def main_example(model: CModel) -> str:
    """The text of the program."""
    shown = range(min(len(model.outputs), SHOWN))
    values = ["m.t", *(f"y[{i}]" for i in shown)]
    form = f'"{" ".join(["%g"] * len(values))}\\n", {", ".join(values)}'
    start = "    if (NAME_initialise(&m) < 0)\n        return 1;\n" if model.system.events else ""
    return EXAMPLE.replace("FORMAT", form).replace("INITIALISE", start).replace("NAME", model.name)

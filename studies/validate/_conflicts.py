"""Contradictions in the thesis or with data sheets, with the values used; and figures that are not compared."""

# Item, printed values, value used.
CONFLICTS = (
    (
        "Figs. 7.5 and 7.6",
        "captions with 13.5 V for 105 ms and 9.5 V for 70 ms; a higher voltage cannot open later",
        "swapped: 105 ms at 9.45 V, as in note 2 to the concluding table, and 70 ms at 13.5 V",
    ),
    (
        "opening of the FISE",
        "148 ms in Fig. 7.4, 140 ms in the concluding table",
        "both; 140 ms is simulated, Fig. 6.6",
    ),
    ("opening of the RE50 at 9.45 V", "105 ms in Fig. 7.5, 100 ms in the concluding table", "both"),
    ("EHS, held", "18 A in the caption of Fig. 7.10, about 20 A measured in the text of chapter 7", "both"),
    ("friction of the EHS", "8e-4 in the test without load, 4e-3 in Table 8.3", "4e-3; 8e-4 is the no-load set"),
    ("winding of the FISE", "0.133 ohm in Table 8.1, 0.2 ohm by multimeter", "0.133 ohm"),
    ("winding of the RE50", "0.309 ohm in Table 8.2, 0.103 ohm in its data sheet", "0.309 ohm"),
    (
        "peak currents",
        "200, 100, 60 and over 40 A measured; 101, 44, 31 and 34 A are voltage over resistance",
        "voltage over resistance",
    ),
    (
        "pressure of the EHS",
        "80 bar for 800 N in section 6.4; 18 to 20 A hold 27 to 30 bar",
        "33.4 bar, from the slave bore",
    ),
    (
        "gearhead GP 42 C, 12:1",
        "4.5 N.m, 90 %, 260 g in Table 6.2, which are intermittent values of one stage, up to 6:1; 12:1 requires two "
        "stages: 7.5 N.m, 81 %, 360 g according to the manufacturer",
        "both rows in the catalogue",
    ),
    ("gearhead GP 52 C", "6 N.m in Table 6.3, intermittent; 4 N.m continuous according to the manufacturer", "both"),
    (
        "worm of the present actuator",
        "efficiency of 52.1 % in Table 6.2 and 50 % in the text; held without current in section 6.1, which requires "
        "50 % or less",
        "no current; in `architectures` 49 %",
    ),
    ("mass of the FISE", "1000 g in Table 6.2, 1200 g in the concluding table", "1200 g"),
    ("speed of the RE50", "5680 rpm in Table 6.3, nominal; 5950 rpm in the concluding table, without load", "5950 rpm"),
    ("inertia of the cam", "25 % lower in the text; Table 6.1 has 27.6 %", "Table 6.1"),
    (
        "Eqs. 8.11 to 8.13",
        "C w^2 / 2 called an energy loss; it is half of the power C w^2",
        "their ratio, which is correct",
    ),
    ("friction of the piston", "N/s in Table 8.1, N.s/m in Tables 8.2 and 8.3", "N.s/m"),
    (
        "loss areas of the five EHS circuits",
        "Fig. 1.4; the text refers to Fig. 1.2",
        "Fig. 1.4; Fig. 1.2 shows the circuits",
    ),
    ("volumes in the concluding table", "580, 620 and 480 mm3", "cm3"),
)

# Figures of the thesis that are not compared, with the reason.
NOT_COMPARED = (
    ("Fig. 3.3, load of the clutch over the stroke", "no numbers printed; the linear spring of the test rig is used"),
    ("chapter 6, pressure drop of the housing by CFD", "called small, no number printed; see `beyond`"),
    ("Fig. 1.4, (4) and (5) called the most efficient", "no numbers printed; see `architectures`"),
    ("Table 6.1, inertia of the cam", "not a result of a model"),
    ("chapter 4, identified inertia 25 % below that of the drawings", "the inertia of the drawings is not printed"),
    ("Tables 6.2 to 6.4, limits, efficiencies and masses of gearheads and pump", "data-sheet values"),
    (
        "Tables 8.1 to 8.3, damping of the liquid and of the piston",
        "no measured figure depends on them; see `prototypes`",
    ),
    ("chapter 8, test without load", "no current or speed printed, only the friction, which is the no-load set"),
    (
        "Table 6.2, efficiency of the worm, 52.1 %",
        "gear losses are included in the motor friction, as in Tables 8.1-8.3",
    ),
    ("concluding table, masses and volumes", "not results of a model"),
    ("Figs. 7.4-7.10, curves over time", "without the data, only scalars can be read"),
)

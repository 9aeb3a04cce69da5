import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="Explore a design")


@app.cell
def _():
    import marimo as mo

    from acausal import AcausalError
    from acausal.design._explore.charts import charts
    from acausal.design._explore.html import table
    from acausal.design._explore.served import offered
    from acausal.design._explore.sliders import positions

    return AcausalError, charts, mo, offered, positions, table


@app.cell
def _(mo, offered):
    asked = mo.query_params().get("design")
    model = mo.ui.dropdown(list(offered), value=asked if asked in offered else next(iter(offered)), label="Model")
    return (model,)


@app.cell
def _(mo, model, offered):
    with mo.status.spinner(f"Compiling {model.value} ..."):
        explorer = offered[model.value]()
        start = explorer.at()
    result = mo.ui.dropdown([one.name for one in explorer.objectives], value=explorer.objectives[0].name, label="Result")
    get_values, set_values = mo.state(start.values)
    get_verdict, set_verdict = mo.state("")
    return explorer, get_values, get_verdict, result, set_values, set_verdict, start


@app.cell
def _(explorer, get_values, mo, positions):
    free = explorer.free
    places = positions(free, free.changed(free.values(explorer.problem.model), get_values()))
    at = [get_values()[name] for name in free.names]
    sliders = mo.ui.array(
        [
            mo.ui.slider(
                steps=list(place),
                value=next(shown for shown, value in place.items() if value == here),
                label=variable.scale.headed(variable.name),
                show_value=True,
                full_width=True,
            )
            for variable, place, here in zip(free.variables, places, at, strict=True)
        ]
    )
    return places, sliders


@app.cell
def _(mo, result):
    best = mo.ui.run_button(label=f"Minimise {result.value} from here")
    back = mo.ui.run_button(label="Back to the start")
    return back, best


@app.cell
def _(explorer, places, sliders):
    chosen = [place[shown] for place, shown in zip(places, sliders.value, strict=True)]
    now = explorer.at(dict(zip(explorer.free.names, chosen, strict=True)))
    return (now,)


@app.cell
def _(AcausalError, back, best, explorer, mo, now, result, set_values, set_verdict, start):
    if best.value:
        with mo.status.spinner("Searching ..."):
            try:
                design = explorer.optimum(now.values, result.value)
                set_values(design.values)
                set_verdict(str(design))
            except AcausalError as error:
                set_verdict(str(error))
    if back.value:
        set_values(start.values)
        set_verdict("")
    return


@app.cell
def _(back, best, charts, get_verdict, mo, model, now, result, sliders, start, table):
    def picture(kind):
        import io

        content = io.BytesIO()
        now.figure().savefig(content, format=kind)
        return content.getvalue()

    inputs = []
    for i, slider in enumerate(sliders):
        inputs.append(slider)
    gradient = mo.Html(table(("parameter", "value", "one unit more", "1 % more"), now.gradient_rows(result.value))) if now.results else mo.md("")
    left = mo.vstack([model, result, *inputs, gradient, mo.hstack([best, back], justify="start")])
    downloads = mo.hstack(
        [
            mo.download(now.to_json, "design.json", "application/json", label="Design (JSON)"),
            mo.download(lambda: picture("png"), "curves.png", "image/png", label="Curves (PNG)"),
            mo.download(lambda: picture("svg"), "curves.svg", "image/svg+xml", label="Curves (SVG)"),
        ],
        justify="start",
        wrap=True,
    )
    found = mo.Html(table(("result", "value", "limit", "margin", ""), now.result_rows(), now.broken))
    said = mo.callout(now.message, kind="danger") if now.message else mo.md("")
    verdict = mo.md(f"```text\n{get_verdict()}\n```") if get_verdict() else mo.md("")
    right = mo.vstack([said, found, *charts(now, start), verdict, downloads])
    mo.hstack([left, right], widths=[1, 2], wrap=True, align="start")
    return


if __name__ == "__main__":
    app.run()

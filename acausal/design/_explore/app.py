import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="Explore a design")


@app.cell
def _():
    import marimo as mo

    from acausal.design._explore import widgets
    from acausal.design._explore.served import offered

    return widgets, mo, offered


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
    result = mo.ui.dropdown([one.name for one in explorer.objectives], explorer.objectives[0].name, label="Result")
    energy = mo.ui.switch(label="Energy by component")
    get_values, set_values = mo.state(start.values)
    get_verdict, set_verdict = mo.state("")
    return energy, explorer, get_values, get_verdict, result, set_values, set_verdict, start


@app.cell
def _(explorer, widgets, get_values, mo):
    sliders = mo.ui.array(widgets.sliders(explorer.free, get_values()))
    return (sliders,)


@app.cell
def _(explorer, mo):
    varied = mo.ui.array([mo.ui.checkbox(name not in explorer.held, label="vary") for name in explorer.free.names])
    return (varied,)


@app.cell
def _(mo):
    best = mo.ui.button(value=0, on_click=lambda clicks: clicks + 1, label="Minimise the result from here")
    back = mo.ui.button(value=0, on_click=lambda clicks: clicks + 1, label="Back to the start")
    handled = {"best": 0, "back": 0}  # clicks; a search moves the sliders, which runs its cell again
    return back, best, handled


@app.cell
def _(explorer, widgets, get_values, sliders):
    now = explorer.at(widgets.chosen(explorer.free, get_values(), sliders.value))
    return (now,)


@app.cell
def _(back, best, explorer, widgets, handled, mo, now, result, set_values, set_verdict, start, varied):
    if best.value > handled["best"]:
        handled["best"] = best.value
        with mo.status.spinner("Searching ..."):
            values, verdict = widgets.optimum(explorer, now, result.value, varied.value)
        set_values(values)
        set_verdict(verdict)
    if back.value > handled["back"]:
        handled["back"] = back.value
        set_values(start.values)
        set_verdict("")
    return


@app.cell
def _(back, best, energy, widgets, get_verdict, mo, model, now, result, sliders, start, varied):
    buttons = mo.hstack([best, back], justify="start", wrap=True)
    left = mo.vstack([model, result, *widgets.inputs(now, sliders, varied, result.value), buttons])
    right = mo.vstack(
        [*widgets.outputs(now, start), energy, widgets.energy(now, energy.value), widgets.text(get_verdict())]
    )
    widgets.columns(left, mo.vstack([right, widgets.downloads(now)]))
    return


if __name__ == "__main__":
    app.run()

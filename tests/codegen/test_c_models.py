"""Models in C against the functions of the engine: rates, derivatives, event indicators, events at the start."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _c_models import MODELS
from _compiled import Compiled, needs_compiler

from acausal._evaluate.observe import observe
from acausal._integrate.loop.loop_start import event_start

pytestmark = [needs_compiler, pytest.mark.filterwarnings("ignore::acausal.JumpWarning")]
QUICK = ("nonlinear block", "wall", "clock", "star")
T = 0.03
CASES = [pytest.param(name, marks=[] if name in QUICK else pytest.mark.thorough) for name in MODELS]


@pytest.fixture(scope="module", params=CASES)
def compiled(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Compiled:
    name = request.param
    return Compiled(MODELS[name](), tmp_path_factory.mktemp("model"), name=name.replace(" ", "_"))


def moved(compiled: Compiled) -> None:
    """Move the states away from the start."""
    system, random = compiled.model.system, np.random.default_rng(0)
    compiled.call("start")
    compiled.struct.t = T
    compiled.x[:] += 1e-2 * system.nominals * random.uniform(0.5, 1.0, compiled.model.n_states)


def test_rates_and_their_derivatives(compiled: Compiled) -> None:
    model, system = compiled.model, compiled.model.system
    moved(compiled)
    n = model.n_states
    rest = jnp.asarray(compiled.point[n:])

    def field(t: jax.Array, x: jax.Array) -> jax.Array:
        return system.vector_field(t, jnp.concatenate([x, rest]), model.inputs)

    direction = system.nominals * np.random.default_rng(1).normal(size=n)
    point = jnp.asarray(T), jnp.asarray(compiled.x)
    wanted, along = jax.jvp(field, point, (jnp.asarray(1.0), jnp.asarray(direction)))
    size = np.abs(np.asarray(wanted)) + system.nominals
    found = compiled.vector("rates", n)
    np.testing.assert_allclose(found / size, wanted / size, rtol=0.0, atol=1e-12)
    size = np.abs(np.asarray(along)) + np.abs(wanted) + system.nominals
    found = compiled.vector("along", n, 1.0, direction)
    np.testing.assert_allclose(found / size, along / size, rtol=0.0, atol=1e-12)


def test_outputs(compiled: Compiled) -> None:
    model, system = compiled.model, compiled.model.system
    moved(compiled)
    found = compiled.outputs
    leaves = [i for i, leaf in enumerate(system.flat.own_leaves) if leaf.declaration.is_variable and not leaf.in_port]
    values = observe(system, jnp.asarray(T), jnp.asarray(compiled.point), model.inputs, leaves)
    for leaf, value in zip(leaves, values, strict=True):
        own = system.flat.leaves[leaf]
        names = [own.name(i) for i in range(own.count)]
        names = [f"{name}[{k}]" for name in names for k in range(int(np.prod(own.sizes)))] if own.sizes else names
        np.testing.assert_allclose([found[name] for name in names], np.ravel(value), rtol=1e-11, atol=1e-12)


def test_event_indicators(compiled: Compiled) -> None:
    model, system = compiled.model, compiled.model.system
    events = system.events
    if events is None:
        pytest.skip("a model without events")
    moved(compiled)
    compiled.call("evaluate", gives=None)
    found = compiled.vector("indicators", events.n_relations)
    read = [leaf for leaf in events.indicators.leaves if system.flat.is_variable(leaf)]
    point = jnp.asarray(compiled.point)
    known = dict(zip(read, observe(system, jnp.asarray(T), point, model.inputs, read), strict=True))
    known = system.carried.with_discrete(model.inputs, point).params.leaves | known
    values = events.indicators([known[leaf] for leaf in events.indicators.leaves])
    wanted = np.concatenate([np.zeros(0), *(np.ravel(value) for value in values)])
    np.testing.assert_allclose(found, wanted, rtol=1e-11, atol=1e-12)


def test_events_at_the_start(compiled: Compiled) -> None:
    """Past time events, and those whose conditions hold."""
    model, system = compiled.model, compiled.model.system
    if system.events is None:
        pytest.skip("a model without events")
    compiled.call("start")
    wanted = event_start(system, jnp.asarray(0.0), jnp.asarray(compiled.x), model.inputs, None)
    compiled.call("initialise")
    np.testing.assert_allclose(compiled.array("d", model.layout.n_discrete), wanted.discrete, rtol=1e-12, atol=1e-12)
    # The nearest point at which nonlinear constraints hold is found to a part in 1e5 of the nominal sizes.
    exact = compiled.model.name != "striker"
    np.testing.assert_allclose(compiled.x, wanted.states, rtol=1e-12 if exact else 1e-4, atol=1e-12)
    np.testing.assert_array_equal(compiled.array("holds"), np.asarray(wanted.holds)[: system.events.total])


@pytest.mark.thorough
@pytest.mark.parametrize("method", ["explicit", "rk4"])
def test_files_of_all_methods_compile_without_a_warning(tmp_path: Path, method: str) -> None:
    Compiled(MODELS["nonlinear block"](), tmp_path, method)

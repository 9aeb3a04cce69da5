"""Random numbers: the generators of ModelicaRandom, by S. Vigna. Their states are pairs of integers of 32 bits."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from ...._errors import ModelError
from ..values import is_known, plain


def _words(state: Any) -> tuple[Any, Any]:
    """The state as numbers of 64 bits, and the library of arrays that works on them."""
    xp = np if is_known(state) else jnp
    halves = (xp.asarray(state).astype(xp.int64) & 0xFFFFFFFF).astype(xp.uint64)
    return halves[0::2] | (halves[1::2] << xp.uint64(32)), xp


def _halves(words: Any, xp: Any) -> Any:
    """Numbers of 64 bits as pairs of signed integers of 32 bits."""
    low, high = words & xp.uint64(0xFFFFFFFF), words >> xp.uint64(32)
    both = xp.ravel(xp.stack([low, high], axis=1)).astype(xp.int64)
    signed = both - ((both >> 31) << 32)
    return signed if xp is np else signed.astype(float)


def _share(word: Any, xp: Any) -> Any:
    """A number of 64 bits as one between 0 and 1."""
    return plain(word.astype(xp.int64).astype(float) * 2.0**-64 + 0.5)


def _xorshift64star(state: Any) -> tuple[Any, Any]:
    x, xp = _words(state)
    x = x ^ (x >> xp.uint64(12))
    x = x ^ (x << xp.uint64(25))
    x = x ^ (x >> xp.uint64(27))
    x = x * xp.uint64(2685821657736338717)
    return _share(x[0], xp), _halves(x, xp)


def _xorshift128plus(state: Any) -> tuple[Any, Any]:
    words, xp = _words(state)
    a, b = words[:1], words[1:]
    a = a ^ (a << xp.uint64(23))
    last = (a ^ b ^ (a >> xp.uint64(17)) ^ (b >> xp.uint64(26))) + b
    return _share(last[0], xp), _halves(xp.concatenate([b, last]), xp)


def _xorshift1024star(state: Any) -> tuple[Any, Any]:
    (words, xp), place = _words(state[:32]), state[32]
    place = (int(place) if is_known(place) else jnp.asarray(place).astype(int)) & 15
    after = (place + 1) & 15
    a, b = words[place], words[after]
    b = b ^ (b << xp.uint64(31))
    b = b ^ (b >> xp.uint64(11))
    new = a ^ (a >> xp.uint64(30)) ^ b
    words = xp.where(xp.arange(16) == after, new, words)
    product = xp.asarray([new]) * xp.uint64(1181783497276652981)
    last = xp.asarray([after]).astype(_halves(words, xp).dtype)
    return _share(product[0], xp), xp.concatenate([_halves(words, xp), last])


def _impure(*args: Any) -> Any:
    raise ModelError(
        "the function impureRandom is not supported, since its values depend on the order of calls; use a generator of "
        "Modelica.Math.Random.Generators with a state."
    )


def _automatic_seed(*args: Any) -> Any:
    raise ModelError(
        "the function automaticGlobalSeed is not supported, since each run would differ; use a fixed seed "
        "(useAutomaticSeed=false)."
    )


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "ModelicaRandom_xorshift64star": _xorshift64star,
    "ModelicaRandom_xorshift128plus": _xorshift128plus,
    "ModelicaRandom_xorshift1024star": _xorshift1024star,
    "ModelicaRandom_setInternalState_xorshift1024star": lambda state, identity: (),
    "ModelicaRandom_impureRandom_xorshift1024star": _impure,
    "ModelicaRandom_automaticGlobalSeed": _automatic_seed,
}

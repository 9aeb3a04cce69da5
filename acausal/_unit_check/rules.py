"""Rules for the dimension of the result of an operation, by the name of the primitive."""

from fractions import Fraction

SAME = frozenset(
    """
    neg abs convert_element_type copy copy_p reduce_precision real stop_gradient optimization_barrier broadcast_in_dim
    reshape squeeze expand_dims transpose rev slice dynamic_slice gather split reduce_sum reduce_max reduce_min cumsum
    cummax cummin sort device_put
    """.split()
)
SILENT = SAME - {"abs", "neg", "reduce_sum", "reduce_max", "reduce_min", "cumsum", "cummax", "cummin"}
EQUAL = {
    "add": "adds", "add_any": "adds", "sub": "subtracts", "max": "takes the larger of", "min": "takes the smaller of",
    "rem": "takes the remainder of", "concatenate": "joins", "pad": "pads", "clamp": "limits",
    "dynamic_update_slice": "replaces a part of", "scatter": "replaces a part of", "scatter-add": "adds",
    "nextafter": "compares",
}  # fmt: skip
COMPARED = frozenset("lt le gt ge eq ne lt_to le_to eq_to atan2".split())
NUMBERS = frozenset(
    """
    exp exp2 expm1 log log1p log2 one_minus_square sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh
    logistic erf erfc erf_inv lgamma digamma bessel_i0e bessel_i1e floor ceil round cumprod cumlogsumexp
    """.split()
)
POWERS = {"sqrt": Fraction(1, 2), "cbrt": Fraction(1, 3), "rsqrt": Fraction(-1, 2), "square": Fraction(2)}
PLAIN = frozenset(
    "sign iota and or not xor is_finite argmax argmin reduce_and reduce_or reduce_xor population_count".split()
)

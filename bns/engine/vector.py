"""Sixteen float32 side by side in compiled code: one register of a processor with AVX-512.

A loop that the compiler turns into vectors by itself ends in a loop of single numbers, holds one register for every weight, and
adds up what its registers hold one after the other. A kernel written with these functions says how it is to be done instead.
Arithmetic is as written: nothing is reordered or contracted.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, models, register_model

LANES = 16
_HALF = LANES // 2


class Vector(types.Type):
    """Numba's type of a vector: only within compiled code, no argument or result of a kernel that Python calls."""

    def __init__(self) -> None:
        super().__init__(name=f"vector of {LANES} float32")


VECTOR = Vector()
_IR = ir.VectorType(ir.FloatType(), LANES)


@register_model(Vector)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _IR)


def _mask(numbers: Any) -> ir.Constant:
    numbers = list(numbers)
    return ir.Constant(ir.VectorType(ir.IntType(32), len(numbers)), numbers)


def _pointer(context: Any, builder: Any, kind: Any, lanes: int, array: Any, at: Any) -> Any:
    place = builder.gep(context.make_array(kind)(context, builder, array).data, [at])
    return builder.bitcast(place, ir.VectorType(ir.FloatType(), lanes).as_pointer())


def _fused(builder: Any, a: Any, b: Any, c: Any) -> Any:
    """a * b + c, rounded once."""
    name = f"llvm.fma.v{a.type.count}f32" if isinstance(a.type, ir.VectorType) else "llvm.fma.f32"
    kind = ir.FunctionType(a.type, [a.type] * 3)
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [a, b, c])


def _splat(builder: Any, number: Any) -> Any:
    one = builder.insert_element(ir.Constant(_IR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, one, _mask([0] * LANES))


def _load(_typing, array, at):  # type: ignore[no-untyped-def]  # compiled
    """The numbers of a flat array from ``at`` on. Nothing is checked, as in any kernel."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return builder.load(_pointer(context, builder, array, LANES, *arguments), align=4)

    return VECTOR(array, types.intp), generate


def _store(_typing, array, at, vector):  # type: ignore[no-untyped-def]  # compiled
    """Put a vector into a flat array from ``at`` on."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        builder.store(arguments[2], _pointer(context, builder, array, LANES, *arguments[:2]), align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp, vector), generate


def _spread(_typing, number):  # type: ignore[no-untyped-def]  # compiled
    """One number in every lane."""
    return VECTOR(types.float32), lambda _context, builder, _signature, arguments: _splat(builder, arguments[0])


def _fma(_typing, a, b, c):  # type: ignore[no-untyped-def]  # compiled
    """a * b + c, rounded once, of vectors or of numbers."""
    return a(a, b, c), lambda _context, builder, _signature, arguments: _fused(builder, *arguments)


def _without(_typing, a, b, c):  # type: ignore[no-untyped-def]  # compiled
    """c - a * b, rounded once, of vectors or of numbers."""

    def generate(_context, builder, _signature, arguments):  # type: ignore[no-untyped-def]
        one, other, whole = arguments
        return _fused(builder, builder.fneg(one), other, whole)

    return a(a, b, c), generate


def _plus(_typing, a, b):  # type: ignore[no-untyped-def]  # compiled
    return a(a, b), lambda _context, builder, _signature, ab: builder.fadd(*ab)


def _times(_typing, a, b):  # type: ignore[no-untyped-def]  # compiled
    return a(a, b), lambda _context, builder, _signature, ab: builder.fmul(*ab)


def _over(_typing, a, b):  # type: ignore[no-untyped-def]  # compiled
    return a(a, b), lambda _context, builder, _signature, ab: builder.fdiv(*ab)


def _halves(_typing, a, b, c, d):  # type: ignore[no-untyped-def]  # compiled
    """Two times eight lanes: six of a, one of b, one of 0; then of c and d likewise."""

    def generate(_context, builder, _signature, arguments):  # type: ignore[no-untyped-def]
        one, last, other, other_last = (_splat(builder, number) for number in arguments)
        zero = ir.Constant(_IR, [0.0] * LANES)
        both = builder.shuffle_vector(one, other, _mask([0] * _HALF + [LANES] * _HALF))
        lasts = builder.shuffle_vector(last, other_last, _mask([0] * _HALF + [LANES] * _HALF))
        places = [i if i % _HALF < _HALF - 2 else LANES + i for i in range(LANES)]
        kept = builder.shuffle_vector(both, lasts, _mask(places))
        return builder.shuffle_vector(kept, zero, _mask(i if i % _HALF < _HALF - 1 else LANES for i in range(LANES)))

    return VECTOR(*[types.float32] * 4), generate


def _sums(_typing, first, second):  # type: ignore[no-untyped-def]  # compiled
    """The sum of each of sixteen vectors, in two tuples of eight, in the lane of its number.

    The sum of one vector is that of its halves, lane by lane, and of the halves of these, until one is left. The vectors are
    folded together, which takes a quarter of the instructions.
    """

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        v = [one for group in arguments for one in cgutils.unpack_tuple(builder, group, _HALF)]
        # In this order, since each step takes its lanes from within parts of four, which costs less: all sums end in their lanes.
        blocks = [v[4 * block + place] for place in range(4) for block in range(4)]
        low, high = _mask([*range(8), *range(16, 24)]), _mask([*range(8, 16), *range(24, 32)])
        even = _mask([*range(4), *range(8, 12), *range(16, 20), *range(24, 28)])
        odd = _mask([*range(4, 8), *range(12, 16), *range(20, 24), *range(28, 32)])
        front = _mask(b + i for b in range(0, 16, 4) for i in (0, 1, 16, 17))
        back = _mask(b + i for b in range(0, 16, 4) for i in (2, 3, 18, 19))
        left = _mask(b + i for b in range(0, 16, 4) for i in (0, 2, 16, 18))
        right = _mask(b + i for b in range(0, 16, 4) for i in (1, 3, 17, 19))
        for one, other in ((low, high), (even, odd), (front, back), (left, right)):
            blocks = [
                builder.fadd(builder.shuffle_vector(a, b, one), builder.shuffle_vector(a, b, other))
                for a, b in zip(blocks[::2], blocks[1::2], strict=True)
            ]
        return blocks[0]

    return VECTOR(first, second), generate


def _sum_of(_typing, vector):  # type: ignore[no-untyped-def]  # compiled
    """The sum of one vector, in the order of `sums`."""

    def generate(_context, builder, _signature, arguments):  # type: ignore[no-untyped-def]
        folded, width = arguments[0], _HALF
        while width:
            low, high = (builder.shuffle_vector(folded, folded, _mask(range(at, at + width))) for at in (0, width))
            folded, width = builder.fadd(low, high), width // 2
        return builder.extract_element(folded, ir.Constant(ir.IntType(32), 0))

    return types.float32(vector), generate


def _add_products(_typing, array, at, apart, a, b):  # type: ignore[no-untyped-def]  # compiled
    """Add a * b to a flat array, each product rounded once with the sum: the first eight from ``at`` on, the others from
    ``at`` + ``apart``, after the first."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        to, where, further, one, other = arguments
        for begin, place in ((0, where), (_HALF, builder.add(where, further))):
            half = _mask(range(begin, begin + _HALF))
            a_half, b_half = (builder.shuffle_vector(both, both, half) for both in (one, other))
            pointer = _pointer(context, builder, array, _HALF, to, place)
            builder.store(_fused(builder, a_half, b_half, builder.load(pointer, align=4)), pointer, align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, a, b), generate


load: Any = intrinsic(_load)
store: Any = intrinsic(_store)
spread: Any = intrinsic(_spread)
fma: Any = intrinsic(_fma)
without: Any = intrinsic(_without)
plus: Any = intrinsic(_plus)
times: Any = intrinsic(_times)
over: Any = intrinsic(_over)
halves: Any = intrinsic(_halves)
sums: Any = intrinsic(_sums)
sum_of: Any = intrinsic(_sum_of)
add_products: Any = intrinsic(_add_products)

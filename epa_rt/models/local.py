"""Arrays and parameters on the stack of a compiled function: nobody else sees them, so the compiler
keeps them in registers, works out before the loop what does not change in it, and leaves out what
is known to be off.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from epa_rt.models.groups import known_places

_F8, _I8, _INDEX = ir.DoubleType(), ir.IntType(8), ir.IntType(64)


@intrinsic(prefer_literal=True)
def local_zeros(context, count):
    """``count`` zeros (f8; a number known when compiling) that live as long as the function that
    the caller is inlined into.
    """
    if not isinstance(count, types.IntegerLiteral):
        return None
    size, kind = count.literal_value, types.Array(types.float64, 1, "C")

    def lay_out(context, builder, signature, arguments):
        data = cgutils.alloca_once(builder, ir.ArrayType(_F8, size))
        cgutils.memset(builder, data, _INDEX(8 * size), 0)
        array = make_array(kind)(context, builder)
        populate_array(
            array,
            data=builder.bitcast(data, _F8.as_pointer()),
            shape=cgutils.pack_array(builder, [_INDEX(size)]),
            strides=cgutils.pack_array(builder, [_INDEX(8)]),
            itemsize=_INDEX(8),
            meminfo=None,
        )
        return array._getvalue()

    return kind(count), lay_out


@intrinsic(prefer_literal=True)
def local_params(context, params, groups):
    """A copy of a PARAMS record that lives as long as the function that the caller is inlined into.

    ``groups`` (groups.py, known when compiling): those whose effects may be on. Of all others the
    copy holds the neutral values as constants, whatever ``params`` says.
    """
    if not isinstance(groups, types.IntegerLiteral):
        return None
    known = known_places(groups.literal_value)

    def lay_out(context, builder, signature, arguments):
        copy = cgutils.alloca_once(builder, ir.ArrayType(_I8, params.size))
        copy.align = 8
        source = builder.bitcast(arguments[0], copy.type)
        cgutils.raw_memcpy(builder, copy, source, _INDEX(params.size), 1, align=8)
        for place, neutral in known:
            at = builder.gep(copy, [_INDEX(0), _INDEX(place)])
            builder.store(_F8(neutral), builder.bitcast(at, _F8.as_pointer()), align=8)
        return builder.bitcast(copy, arguments[0].type)

    return params(params, groups), lay_out

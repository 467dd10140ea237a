"""Compiles code that looks up numbers in arrays, for what it does.

numba takes every signed index for one that may be negative and then counts from the end: two more
instructions an index, for which every access waits. In the packet kernel, which does little else
than look up whole numbers in tables, they were a third of all instructions.
"""

from typing import Any

import numpy as np
from numba.core import ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.untyped_passes import InlineInlinables


class IndicesFromZero(CompilerBase):
    """numba's compiler, which takes every index as not negative.

    A slice is no index of an element: functions with slices are not for this compiler.
    """

    def define_pipelines(self) -> list[Any]:
        """Return the one pipeline."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_UnsignedIndices, InlineInlinables)
        passes.finalize()
        return [passes]


@register_pass(mutates_CFG=False, analysis_only=False)
class _UnsignedIndices(FunctionPass):
    """Makes unsigned numbers of the indices with which elements are read and written."""

    _name = "unsigned_indices"

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Return whether anything was changed."""
        blocks = state.func_ir.blocks.values()
        tuples = {
            statement.target.name: statement.value.items
            for block in blocks
            for statement in block.find_insts(ir.Assign)
            if isinstance(statement.value, ir.Expr) and statement.value.op == "build_tuple"
        }
        changed = [_rewrite(block, tuples) for block in blocks]
        return any(changed)


def _rewrite(block: Any, tuples: dict[str, list[Any]]) -> bool:
    """Rewrite a block, given the items of each tuple; return whether it has changed."""
    body: list[Any] = []
    for statement in block.body:
        access = statement.value if isinstance(statement, ir.Assign) else statement
        if isinstance(access, ir.SetItem) or (
            isinstance(access, ir.Expr) and access.op == "getitem"
        ):
            items = tuples.get(access.index.name)
            if items is None:
                access.index = _unsigned(access.index, block.scope, body)
            else:
                numbers = [_unsigned(item, block.scope, body) for item in items]
                access.index = block.scope.redefine("$indices", statement.loc)
                value = ir.Expr.build_tuple(numbers, statement.loc)
                body.append(ir.Assign(value, access.index, statement.loc))
        body.append(statement)
    has_changed = len(body) > len(block.body)
    block.body = body
    return has_changed


def _unsigned(index: Any, scope: Any, body: list[Any]) -> Any:
    """Return an index as an unsigned number, after adding to a block's body what makes it one."""
    loc = index.loc
    function, number = scope.redefine("$unsigned", loc), scope.redefine("$index", loc)
    body.append(ir.Assign(ir.Global("uintp", np.uintp, loc), function, loc))
    body.append(ir.Assign(ir.Expr.call(function, (index,), (), loc), number, loc))
    return number

import marrow
import pytest


@pytest.mark.parametrize(
    ("error", "builtin"),
    [
        (marrow.InputError, ValueError),
        (marrow.GeometryError, ValueError),
        (marrow.IoError, OSError),
        (marrow.LimitError, MemoryError),
    ],
)
def test_handlers_of_the_builtin_exception_catch_it(error, builtin):
    assert issubclass(error, builtin)
    assert issubclass(error, marrow.Error)

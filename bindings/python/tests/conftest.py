import numpy as np
import pytest


@pytest.fixture(scope="session")
def ball():
    """An ellipsoid that is bright inside, int16, with a surface at 300.5 that does not touch the border."""
    z, y, x = np.mgrid[:30, :31, :32]
    return (1000 - 8 * ((x - 15) ** 2 + 1.2 * (y - 14) ** 2 + 1.4 * (z - 13) ** 2)).astype(np.int16)

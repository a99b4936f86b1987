"""Surfaces on a device of Vulkan, which may be one that is emulated by the CPU."""

import os
import subprocess
import sys
import warnings

import marrow
import numpy as np
import pytest


@pytest.fixture(scope="module")
def software():
    """The number of a software device."""
    numbers = [n for n, device in enumerate(marrow.devices()) if device.kind == "software"]
    if not numbers:
        pytest.skip("there is no software device of Vulkan")
    return numbers[0]


@pytest.fixture
def ball():
    k, j, i = np.ogrid[:20, :24, :28]
    return np.maximum(0, 100 - 10 * np.sqrt((k - 9) ** 2 + (j - 11) ** 2 + (i - 13) ** 2)).astype(np.int16)


def same(one, other):
    return all(
        getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in ["points", "normals", "triangles"]
    )


def test_devices_are_described(software):
    device = marrow.devices()[software]
    assert device.name and device.driver
    assert device.memory > 2**28


def test_the_mesh_has_the_same_bytes(ball, software):
    extractor = marrow.IsosurfaceExtractor(ball, closed=True, device=software)
    assert extractor.device == marrow.devices()[software].name
    for isovalue in (30.5, 50.0, 30.5):
        mesh = extractor.extract(isovalue)
        assert len(mesh.triangles) > 100
        assert same(mesh, marrow.extract(ball, isovalue, closed=True))
    preview = marrow.IsosurfaceExtractor(ball, closed=True).extract(30.5, level=1)
    assert same(extractor.extract(30.5, level=1), preview)


def test_a_device_is_found_by_its_name(ball, software):
    name = marrow.devices()[software].name
    assert marrow.IsosurfaceExtractor(ball, device=name.upper()).device == name


def test_software_devices_are_never_chosen_automatically(ball):
    kinds = [device.kind for device in marrow.devices()]
    extractor = marrow.IsosurfaceExtractor(ball, device="auto")
    assert (extractor.device == "cpu") == (set(kinds) <= {"software"})
    assert marrow.IsosurfaceExtractor(ball).device == "cpu"


def test_a_device_that_is_missing_is_an_error(ball):
    with pytest.raises(marrow.DeviceError, match="there is no device 'voodoo'") as error:
        marrow.IsosurfaceExtractor(ball, device="voodoo")
    assert isinstance(error.value, marrow.Error) and isinstance(error.value, RuntimeError)
    with pytest.raises(marrow.DeviceError, match="there is no device '99'"):
        marrow.IsosurfaceExtractor(ball, device=99)


def test_the_cpu_does_what_the_device_cannot(ball, software):
    with pytest.warns(RuntimeWarning, match="the CPU extracts instead of .*: GPUs take no samples of type float64"):
        extractor = marrow.IsosurfaceExtractor(ball.astype(float), device=software)
    assert extractor.device == "cpu"
    assert same(extractor.extract(30.5), marrow.extract(ball.astype(float), 30.5))
    with pytest.raises(marrow.InputError):
        marrow.IsosurfaceExtractor(ball, snap=0.7, device=software)


def test_the_cpu_takes_over_where_the_device_fails(ball, software):
    denormal = ball.astype(np.float32) * np.float32(1e-42)
    extractor = marrow.IsosurfaceExtractor(denormal, device=software)
    assert extractor.device != "cpu"
    isovalue = 30.5e-42
    with pytest.warns(RuntimeWarning, match="the CPU extracts instead of"):
        mesh = extractor.extract(isovalue)
    assert same(mesh, marrow.extract(denormal, isovalue))
    assert extractor.device == "cpu"
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # there is only one warning
        extractor.extract(isovalue)


def test_progress_is_reported_and_can_cancel(ball, software):
    extractor = marrow.IsosurfaceExtractor(ball, device=software)
    with pytest.raises(marrow.Cancelled):
        extractor.extract(30.5, progress=lambda fraction: False)
    assert same(extractor.extract(30.5), marrow.extract(ball, 30.5))


def test_there_are_no_devices_without_a_driver():
    code = "import marrow; print(marrow.devices()); marrow.IsosurfaceExtractor([[[1.0]]], device='gpu')"
    none = {"VK_DRIVER_FILES": "/nonexistent.json", "VK_ICD_FILENAMES": "/nonexistent.json"}
    result = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **none}, capture_output=True, text=True
    )
    assert result.stdout == "[]\n"
    reasons = "no Vulkan driver is installed", "Marrow was built without Vulkan"
    assert any(f"marrow.DeviceError: there is no GPU: {reason}" in result.stderr for reason in reasons)

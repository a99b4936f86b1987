"""The devices that extract surfaces."""

from __future__ import annotations

from dataclasses import dataclass

from . import _marrow


@dataclass(frozen=True)
class Device:
    """A GPU, or a software device, which is emulated by the CPU and good for tests only.

    Attributes
    ----------
    name : str
        As the driver states it.
    kind : str
        'discrete', 'integrated', 'virtual', 'other' or 'software'.
    driver : str
        The name and the version of the driver; empty: unknown.
    memory : int
        Bytes of its largest local memory.
    """

    name: str
    kind: str
    driver: str
    memory: int


def devices() -> list[Device]:
    """List the devices of Vulkan that `IsosurfaceExtractor` can use.

    The first call loads Vulkan, which can take a second.

    Returns
    -------
    list of Device
        The number of a device is its index. Empty where there is no Vulkan driver, or where Marrow was built
        without Vulkan.

    Examples
    --------
    >>> [device.name for device in marrow.devices() if device.kind != "software"]
    ['NVIDIA GeForce RTX 4090']
    """
    return [Device(*values) for values in _marrow.devices()]

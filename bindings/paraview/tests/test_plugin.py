"""The plugin of ParaView extracts the same surface on any number of ranks.

The environment names the plugin (MARROW_PLUGIN) and ParaView's prefix (PARAVIEW).
"""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

RANKS = (1, 2, 3, 4)
SAMPLES = {"nx": 21, "ny": 17, "nz": 13}
# Each of these has a name, a source, and the properties of the filter, which are those of Contour.
JOBS = [
    ("wavelet", "wavelet", {"Isosurfaces": [150.3]}),
    ("several", "wavelet", {"Isosurfaces": [110.5, 150.3, 190.1], "ComputeNormals": 0}),
    ("closed", "wavelet", {"Isosurfaces": [120.25], "Closed": 1, "ComputeScalars": 0}),
    ("chosen", "{folder}/noise.vti", {"Isosurfaces": [2], "ContourBy": ["POINTS", "other"]}),
    ("noise", "{folder}/noise.vti", {"Isosurfaces": [2], "Closed": 1}),  # oblique, and many samples are 2
    ("exact", "{folder}/noise.vti", {"Isosurfaces": [2], "Closed": 1, "ExactTopology": 1}),
    ("in_pieces", "{folder}/noise.nhdr", {"Isosurfaces": [2]}),
    ("on_one_rank", "{folder}/noise.mhd", {"Isosurfaces": [2]}),  # ParaView gives all of it to the first rank
    ("tiny", "{folder}/tiny.vti", {"Isosurfaces": [2]}),  # two cells, so that ranks stay without any
    ("empty", "wavelet", {"Isosurfaces": [1e6]}),
    ("tooth", "{folder}/tooth.nhdr", {"Isosurfaces": [650], "Closed": 1}),
]
# Big-endian samples, with which the reader of ParaView 5.11 ends the process: the test turns them round.
TOOTH = Path(os.environ.get("MARROW_TEST_DATA", "/nonexistent")) / "tooth_sci/tooth_sci/tooth.raw"


def write_vti(path, arrays, extent, direction):
    """An image of VTK with arrays of bytes as text."""
    data = "".join(
        f'<DataArray type="UInt8" Name="{name}" format="ascii">{" ".join(map(str, values.ravel()))}</DataArray>'
        for name, values in arrays.items()
    )
    extent = " ".join(map(str, extent))
    path.write_text(
        f'<VTKFile type="ImageData" version="1.0"><ImageData WholeExtent="{extent}" Origin="10 20 30" Spacing="0.5 1 2" '
        f'Direction="{direction}"><Piece Extent="{extent}"><PointData Scalars="{next(iter(arrays))}">{data}</PointData>'
        "</Piece></ImageData></VTKFile>"
    )


def write_nhdr(path, samples, spacing):
    samples.tofile(path.with_suffix(".raw"))
    sizes = " ".join(map(str, samples.shape[::-1]))
    path.with_suffix(".nhdr").write_text(
        f"NRRD0004\ntype: {samples.dtype.name}\ndimension: 3\nsizes: {sizes}\nspacings: {spacing}\nendian: little\n"
        f"encoding: raw\ndata file: {path.name}.raw\n"
    )


def write_images(folder):
    rng = np.random.default_rng(7)
    nx, ny, nz = SAMPLES.values()
    noise, other = (rng.integers(0, 5, (nz, ny, nx)).astype("u1") for _ in range(2))
    oblique = "0 0.6 0.8 1 0 0 0 0.8 -0.6"
    write_vti(folder / "noise.vti", {"noise": noise, "other": other}, (5, 4 + nx, -7, ny - 8, 11, 10 + nz), oblique)
    tiny = np.array([0, 4, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0], "u1")
    write_vti(folder / "tiny.vti", {"noise": tiny}, (0, 2, 0, 1, 0, 1), "1 0 0 0 1 0 0 0 1")
    write_nhdr(folder / "noise", noise, "0.5 1 2")
    if TOOTH.exists():
        write_nhdr(folder / "tooth", np.fromfile(TOOTH, ">u2").astype("<u2").reshape(161, 94, 103), "1 1 1")
    (folder / "noise.mhd").write_text(
        f"ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = {nx} {ny} {nz}\nElementSpacing = 0.5 1 2\n"
        "ElementType = MET_UCHAR\nElementDataFile = noise.raw\n"
    )


def pvbatch(ranks, name, *arguments):
    paraview = Path(os.environ["PARAVIEW"])
    environment = {
        **os.environ,
        "LD_LIBRARY_PATH": str(next(paraview.glob("lib/*-linux-gnu"))),
        "PYTHONPATH": str(paraview / "lib/python3/dist-packages"),
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    }
    script = Path(__file__).with_name(name)
    # Ranks that wait for others leave them the processor.
    mpi = ["mpirun", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-n", str(ranks)]
    command = [*mpi, str(paraview / "bin/pvbatch"), str(script), os.environ["MARROW_PLUGIN"], *arguments]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def surfaces(tmp_path_factory):
    """By the name of the job and the number of ranks."""
    folder = tmp_path_factory.mktemp("paraview")
    write_images(folder)
    results = {}
    for ranks in RANKS:
        jobs = [
            [source.format(folder=folder), "MarrowContour", properties, str(folder / f"{name}-{ranks}.npz")]
            for name, source, properties in JOBS
            if name != "tooth" or TOOTH.exists()
        ]
        if ranks == 1:
            jobs.append(["wavelet", "Contour", JOBS[0][2], str(folder / "contour-1.npz")])
        assert "ERR" not in pvbatch(ranks, "extract.py", json.dumps(jobs))
        for path in folder.glob(f"*-{ranks}.npz"):
            results[path.stem] = dict(np.load(path))
    return results


def merged(surface):
    """Return the bytes of each point, its normal and its scalar by global id, and the triangles as global ids."""
    ids, triangles = surface["ids"], surface["triangles"].astype(int)
    rows = [surface[name].reshape(len(ids), -1) for name in ("points", "normals", "scalars") if len(surface[name])]
    points = {}
    for key, *row in zip(ids, *rows):
        bits = b"".join(part.tobytes() for part in row)
        assert points.setdefault(key, bits) == bits  # all ranks agree
    return points, sorted(map(tuple, ids[triangles])) if len(ids) else []


@pytest.mark.parametrize("ranks", RANKS[1:])
@pytest.mark.parametrize("name", [name for name, _, _ in JOBS])
def test_all_ranks_together_have_the_surface_of_one(surfaces, name, ranks):
    if name == "tooth" and not TOOTH.exists():
        pytest.skip("MARROW_TEST_DATA has no tooth")
    one, several = (merged(surfaces[f"{name}-{n}"]) for n in (1, ranks))
    assert one == several
    assert (name == "empty") == (len(one[1]) == 0)


def test_the_surface_is_that_of_contour(surfaces):
    ours, theirs = surfaces["wavelet-1"], surfaces["contour-1"]
    for name in ("points", "triangles"):
        assert len(ours[name]) == len(theirs[name]) > 1000
    distances = [np.abs(theirs["points"] - point).sum(1).min() for point in ours["points"]]
    assert max(distances) < 1 / 1024  # of an edge, by which our points keep away from samples
    assert set(ours["scalars"]) == set(theirs["scalars"])


def test_a_closed_surface_has_no_seams(surfaces):
    for name in ("closed", "noise", "exact"):
        ids, triangles = (surfaces[f"{name}-4"][key] for key in ("ids", "triangles"))
        corners = ids[triangles.astype(int)]
        edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
        # Each edge has one triangle on each side, which runs along it the other way.
        assert len(np.unique(edges, axis=0)) == len(edges)
        assert {tuple(edge) for edge in edges} == {tuple(edge) for edge in edges[:, ::-1]}


def test_exact_topology_has_points_inside_cells(surfaces):
    exact, separated = (set(map(tuple, surfaces[name]["points"])) for name in ("exact-1", "noise-1"))
    assert separated < exact


def test_the_menu_has_a_filter_with_the_properties_of_contour(tmp_path):
    pvbatch(1, "describe.py", str(tmp_path / "filters.json"))
    ours, theirs = json.loads((tmp_path / "filters.json").read_text()).values()
    assert (ours["label"], ours["menu"]) == ("Marrow Contour", "Common")
    shared = {"Input", "SelectInputScalars", "ContourValues", "ComputeNormals", "ComputeScalars"}
    assert ours["properties"].keys() & theirs["properties"].keys() == shared
    for name in shared:
        assert ours["properties"][name] == theirs["properties"][name]


def test_properties_choose_what_points_have(surfaces):
    assert len(surfaces["several-1"]["normals"]) == 0 and len(surfaces["closed-1"]["scalars"]) == 0
    assert set(surfaces["several-1"]["scalars"]) == {np.float32(value) for value in (110.5, 150.3, 190.1)}
    assert len(surfaces["chosen-1"]["ids"]) and not np.array_equal(surfaces["chosen-1"]["ids"], surfaces["noise-1"]["ids"])

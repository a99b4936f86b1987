"""Each label of a label map becomes a closed surface with a colour, and VTK draws them.

usage: atlas.py MAP PICTURE.png      (without a screen: xvfb-run -a python3 atlas.py ...)
"""

import sys

import marrow
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (draws)
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter


def actor_of(mesh: marrow.Mesh) -> vtkActor:
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(mesh.to_vtk())  # shares the arrays of the mesh
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(mesh.colour)
    return actor


def main(map_path: str, picture_path: str) -> None:
    surfaces = marrow.labels(marrow.read(map_path))
    renderer = vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    for mesh in surfaces.values():
        renderer.AddActor(actor_of(mesh))
    camera = renderer.GetActiveCamera()  # LPS: from the patient's left, front and above
    camera.SetPosition(1, -1, 0.7)
    camera.SetViewUp(0, 0, 1)
    renderer.ResetCamera()
    camera.Zoom(1.5)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(8)
    window.SetSize(900, 640)
    window.AddRenderer(renderer)
    picture = vtkWindowToImageFilter()
    picture.SetInput(window)
    writer = vtkPNGWriter()
    writer.SetInputConnection(picture.GetOutputPort())
    writer.SetFileName(picture_path)
    writer.Write()
    print(f"drew {len(surfaces)} labels, {sum(len(mesh.triangles) for mesh in surfaces.values())} triangles")


if len(sys.argv) != 3:
    sys.exit(__doc__)
main(*sys.argv[1:])

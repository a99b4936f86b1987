"""Run by pvbatch on several ranks: draws a surface in colours that tell the ranks apart.

usage: picture.py PLUGIN IMAGE ISOVALUE OUTPUT
"""

import sys

from paraview import simple

plugin, image, isovalue, output = sys.argv[1:]
simple.LoadPlugin(plugin, remote=False, ns=globals())
source = simple.OpenDataFile(image)
source.UpdatePipeline()
surface = MarrowContour(Input=source, Isosurfaces=[float(isovalue)])  # noqa: F821, a name that the plugin defines
ranks = simple.ProcessIdScalars(Input=surface)

view = simple.CreateRenderView(ViewSize=[1000, 700], OrientationAxesVisibility=0, UseColorPaletteForBackground=0)
view.Background = [1, 1, 1]
shown = simple.Show(ranks, view)
simple.ColorBy(shown, ("POINTS", "ProcessId"))
colours = simple.GetColorTransferFunction("ProcessId")
colours.InterpretValuesAsCategories = 1
colours.Annotations = [part for rank in range(4) for part in (str(rank), f"rank {rank}")]
colours.IndexedColors = [0.93, 0.90, 0.83, 0.62, 0.75, 0.86, 0.95, 0.76, 0.62, 0.71, 0.83, 0.68]
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [-1, -2, 0.5], [0, 0, 0], [0, 0, 1]
simple.ResetCamera(view)
simple.GetActiveCamera().Zoom(1.5)
simple.Render(view)
simple.SaveScreenshot(output, view)

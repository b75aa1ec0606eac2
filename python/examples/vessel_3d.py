#!/usr/bin/env python3
"""A vessel and the wire in it in three dimensions, with VTK (python3-vtk9): the wall is the zero surface of the library's distance, on a grid.

usage: vessel_3d.py [PICTURE.png [SCENE]]     (default: vessel-3d.png; the phantom, steered by its script; a vessel that is a model or a shape)

Debian's VTK draws through X; without a display: xvfb-run -a vessel_3d.py. PyVista (not in Debian 12) takes the same objects: pyvista.wrap(surface).
"""
import os
import sys

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkImageData, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D, vtkTubeFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter
import vtkmodules.vtkRenderingOpenGL2       # noqa: F401  the renderer that the window uses

import seldinger

CELL_MM = 0.4


def wall(scene, low, high):
    """The wall between two corners, (3,) mm each, as triangles. The distance is asked for near the centrelines only; elsewhere it is outside."""
    axes = [np.arange(a, b, CELL_MM) for a, b in zip(low, high)]
    shape = tuple(len(axis) for axis in axes)
    is_near = np.zeros(shape, bool)
    for node in scene.nodes:
        reach = 1.8 * node["radius_mm"]
        box = tuple(slice(*np.searchsorted(axis, (x - reach, x + reach))) for axis, x in zip(axes, node["center_mm"]))
        is_near[box] = True
    near = np.stack([axis[index] for axis, index in zip(axes, np.nonzero(is_near))], axis=-1)
    gap = np.full(shape, -1.0)
    gap[is_near] = np.clip(scene.query(near)[0], -1, 1)
    image = vtkImageData()
    image.SetDimensions(*shape)
    image.SetSpacing(CELL_MM, CELL_MM, CELL_MM)
    image.SetOrigin(*low)
    image.GetPointData().SetScalars(numpy_to_vtk(gap.ravel(order="F"), deep=True))       # x fastest
    surface = vtkFlyingEdges3D()
    surface.SetInputData(image)
    surface.SetValue(0, 0.0)
    surface.Update()
    return surface.GetOutput()


def wire(nodes, radius):
    """A tool along its nodes, (n, 3) mm."""
    points, line = vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(nodes, deep=True))
    line.InsertNextCell(len(nodes))
    for i in range(len(nodes)):
        line.InsertCellPoint(i)
    polyline = vtkPolyData()
    polyline.SetPoints(points)
    polyline.SetLines(line)
    tube = vtkTubeFilter()
    tube.SetInputData(polyline)
    tube.SetRadius(radius)
    tube.SetNumberOfSides(12)
    tube.Update()
    return tube.GetOutput()


def actor(surface, colour, opacity=1.0):
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(surface)
    mapper.ScalarVisibilityOff()
    shown = vtkActor()
    shown.SetMapper(mapper)
    shown.GetProperty().SetColor(*colour)
    shown.GetProperty().SetOpacity(opacity)
    return shown


def draw(actors, towards, up, path):
    """A picture seen from the direction `towards`, (3,)."""
    renderer, window = vtkRenderer(), vtkRenderWindow()
    renderer.SetBackground(1, 1, 1)
    for one in actors:
        renderer.AddActor(one)
    window.SetOffScreenRendering(1)
    window.SetSize(900, 900)
    window.SetMultiSamples(0)
    window.SetAlphaBitPlanes(1)
    window.AddRenderer(renderer)
    renderer.SetUseDepthPeeling(1)
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*towards)
    camera.SetViewUp(*up)
    renderer.ResetCamera()
    window.Render()
    picture, writer = vtkWindowToImageFilter(), vtkPNGWriter()
    picture.SetInput(window)
    writer.SetInputConnection(picture.GetOutputPort())
    writer.SetFileName(path)
    writer.Write()


def main():
    if not os.environ.get("DISPLAY"):
        sys.exit("vessel_3d.py: Debian's VTK draws through X and there is no display; run it as: xvfb-run -a vessel_3d.py")
    path = sys.argv[1] if len(sys.argv) > 1 else "vessel-3d.png"
    scene = seldinger.Scene(sys.argv[2] if len(sys.argv) > 2 else seldinger.scene_path("phantom/scene.yaml"))
    sim = seldinger.Simulator(scene)
    sim.follow(round(scene.script_s / scene.step_s))
    centres = scene.nodes["center_mm"]
    surface = wall(scene, centres.min(axis=0) - 6, centres.max(axis=0) + 6)
    table = sim.table()
    nodes = table["position_mm"][table["carrier"] >= 0]          # the others are in the sheath
    lao_deg, _, anterior, superior = scene.view
    left = -np.cross(anterior, superior)
    towards = np.cos(np.radians(lao_deg)) * anterior + np.sin(np.radians(lao_deg)) * left        # where the detector is
    draw([actor(surface, (0.85, 0.35, 0.3), 0.35), actor(wire(nodes, 0.25), (0.1, 0.1, 0.15))], towards, superior, path)
    print(f"{surface.GetNumberOfPolys()} triangles of the wall, {len(nodes)} nodes of {scene.tools[-1]}, {path}")


if __name__ == "__main__":
    main()

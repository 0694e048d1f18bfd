"""VTK's volume mappers on the phantom, camera and transfer function of `birdseye bench render --export DIR`.

usage: vtk_peer.py DIR {cpu|gpu} [FRAMES]   (needs python3-vtk9 and a display, for example of xvfb-run)
Prints a JSON line with the keys of birdseye's own rows.
"""

import json
import math
import statistics
import sys
import time

import vtk

folder, mapper_name = sys.argv[1], sys.argv[2]
frames = int(sys.argv[3]) if len(sys.argv) > 3 else 8
with open(folder + "/scene.json", encoding="utf-8") as file:
    scene = json.load(file)

reader = vtk.vtkMetaImageReader()
reader.SetFileName(folder + "/volume.mha")
reader.Update()

colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
for hu, red, green, blue, extinction_per_mm in scene["transfer"]:
    colour.AddRGBPoint(hu, red, green, blue)
    opacity.AddPoint(hu, 1 - math.exp(-extinction_per_mm))
look = vtk.vtkVolumeProperty()
look.SetColor(colour)
look.SetScalarOpacity(opacity)
look.SetScalarOpacityUnitDistance(1.0)
look.SetInterpolationTypeToLinear()
look.ShadeOn()

if mapper_name == "gpu":
    mapper = vtk.vtkGPUVolumeRayCastMapper()
else:
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInteractiveSampleDistance(scene["step_mm"])
mapper.SetAutoAdjustSampleDistances(0)
mapper.SetImageSampleDistance(1.0)
mapper.SetSampleDistance(scene["step_mm"])
mapper.SetInputData(reader.GetOutput())
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(look)

renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetMultiSamples(0)
window.SetSize(scene["width_px"], scene["height_px"])
window.AddRenderer(renderer)
camera = renderer.GetActiveCamera()
camera.SetViewAngle(scene["view_angle_deg"])


def draw(azimuth_deg):
    elevation, azimuth = math.radians(scene["elevation_deg"]), math.radians(azimuth_deg)
    away = (math.cos(azimuth) * math.cos(elevation), math.sin(azimuth) * math.cos(elevation), math.sin(elevation))
    middle = scene["middle_mm"]
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(m + scene["distance_mm"] * a for m, a in zip(middle, away)))
    camera.SetViewUp(0, 0, 1)
    renderer.ResetCameraClippingRange()
    window.Render()
    window.WaitForCompletion()


draw(0)
wall_ms, cpu_ms = [], []
for i in range(frames):
    wall, cpu = time.perf_counter(), time.process_time()
    draw(360.0 * i / frames)
    wall_ms.append(1e3 * (time.perf_counter() - wall))
    cpu_ms.append(1e3 * (time.process_time() - cpu))
median_ms = statistics.median(wall_ms)
print(json.dumps({
    "engine": "vtk " + mapper_name + ", " + vtk.vtkVersion().GetVTKVersion(),
    "phantom": scene["phantom"],
    "volume": scene["volume"],
    "viewport": f'{scene["width_px"]}x{scene["height_px"]}',
    "step_mm": scene["step_mm"],
    "level": 0,
    "frame_ms_median": median_ms,
    "cpu_ms_median": statistics.median(cpu_ms),
    "fps": 1e3 / median_ms,
}))

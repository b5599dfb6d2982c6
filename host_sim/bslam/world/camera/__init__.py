"""The simulated camera: furnished scenes, and pictures of them with the exact truth about every pixel.

    scene = make_world(7)                              # or dress(load_scenario("paper_room"), 7)
    renderer = Renderer(scene, load_rig("three60").cameras[0], seed=1)
    for step, pose in enumerate(walk(scene, np.random.default_rng(1), frames=25)):
        frame = renderer.render(tuple(pose), 0.2 * step)

`render.h` says how a picture comes about.
"""

from bslam.world.camera.drive import free_pose, walk
from bslam.world.camera.looks import STYLES
from bslam.world.camera.renderer import Frame, Renderer, Seen
from bslam.world.camera.rgb565 import from_rgb565, to_rgb565
from bslam.world.camera.scene import CLUTTER, NO_BEACON, BeaconLook, Scene
from bslam.world.camera.worlds import dress, make_world
from bslam.world.kinds import KINDS

__all__ = [
    "CLUTTER",
    "KINDS",
    "NO_BEACON",
    "STYLES",
    "BeaconLook",
    "Frame",
    "Renderer",
    "Scene",
    "Seen",
    "dress",
    "free_pose",
    "from_rgb565",
    "make_world",
    "to_rgb565",
    "walk",
]

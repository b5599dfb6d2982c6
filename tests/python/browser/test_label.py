"""tools/label.html in a real browser: what a user draws is what training reads."""

import json
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from bslam.datasets.labels import Label, read_folder
from bslam.modelfile import BeaconClass

PAGE = Path(__file__).parents[3] / "tools/label.html"
LARGE = (2000, 1500)  # more than the window has, so it is shown reduced
SMALL = (320, 240)
MAGENTA = [255, 0, 255, 255]


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    Image.new("RGB", LARGE, "white").save(tmp_path / "large.png")
    Image.new("RGB", SMALL, "white").save(tmp_path / "small.jpg")
    turned = Image.Exif()
    turned[0x0112] = 6  # the camera was held upright: shown, and labelled, 240 wide and 320 high
    Image.new("RGB", SMALL, "white").save(tmp_path / "upright.jpg", exif=turned)
    return tmp_path


@pytest.fixture
def label(page: Page, pictures: Path) -> Page:
    """The page with the pictures chosen; the first by name is shown."""
    page.goto(PAGE.as_uri())
    choose(page, *sorted(pictures.glob("*.*g")))
    expect(page.get_by_role("button", name="large.png (0)")).to_be_visible()
    page.wait_for_function("image !== null && shown === 'large.png'")
    return page


def choose(page: Page, *paths: Path) -> None:
    page.locator("#files").set_input_files([str(path) for path in paths])


def show(page: Page, name: str, size: tuple[int, int]) -> None:
    page.get_by_role("button", name=name).click()
    page.wait_for_function(f"shown === {json.dumps(name)} && image.width === {size[0]}")


def drag(page: Page, *corners: tuple[float, float]) -> None:
    """Press at the first corner, in px of the picture, let go at the last."""
    canvas = page.locator("#canvas").bounding_box()
    assert canvas is not None
    scale = page.evaluate("scale()")
    (x, y), *rest = [(canvas["x"] + scale * x, canvas["y"] + scale * y) for x, y in corners]
    page.mouse.move(x, y)
    page.mouse.down()
    for x, y in rest:
        page.mouse.move(x, y)
    page.mouse.up()


def save(page: Page, folder: Path) -> None:
    with page.expect_download() as download:
        page.get_by_role("button", name="Save labels.csv").click()
    assert download.value.suggested_filename == "labels.csv"
    download.value.save_as(folder / "labels.csv")


def colour(page: Page, x: float, y: float) -> list[int]:
    """Of the canvas where the picture's point (x, y) is shown."""
    return page.evaluate(f"Array.from(pen.getImageData({x} * scale(), {y} * scale(), 1, 1).data)")


def test_label_boxes_drawn_with_the_mouse_are_what_training_reads(label: Page, pictures: Path) -> None:
    assert label.evaluate("scale()") < 0.6
    label.get_by_label("Class").fill("door")
    label.get_by_label("Its height").fill("2")
    drag(label, (400, 300), (700, 700), (800, 900))
    expect(label.get_by_role("button", name="large.png (1)")).to_be_visible()
    assert colour(label, 400, 600) == MAGENTA
    assert colour(label, 600, 600) == [255, 255, 255, 255]
    show(label, "small.jpg", SMALL)
    label.get_by_label("Class").fill("poster")
    drag(label, (200, 150), (50, 20))  # from the lower right up
    show(label, "upright.jpg", SMALL[::-1])
    drag(label, (20, 250), (100, 310))
    save(label, pictures)
    folder = read_folder(pictures)
    assert folder.objects == (BeaconClass("door", 2.0), BeaconClass("poster"))
    large, small, upright = folder.pictures
    assert (large.path.name, small.path.name, upright.path.name) == ("large.png", "small.jpg", "upright.jpg")
    (box,) = large.labels
    # A pixel of the screen is this many of the picture: no one can point more finely.
    assert (box.left_px, box.top_px, box.right_px, box.bottom_px) == pytest.approx(
        (400, 300, 800, 900), abs=2.5
    )
    assert small.labels == (Label("poster", 50, 20, 200, 150),)
    assert upright.labels == (Label("poster", 20, 250, 100, 310),)


def test_label_goes_on_with_saved_labels_and_a_click_removes(label: Page, pictures: Path) -> None:
    (pictures / "labels.csv").write_text(
        "picture,class,left_px,top_px,right_px,bottom_px,height_m,depth_m\n"
        "small.jpg,door,10,20,110,220,2.0,\nsmall.jpg,door,150,20,250,220,2.0,\n"
    )
    choose(label, pictures / "labels.csv")
    show(label, "small.jpg", SMALL)
    expect(label.get_by_role("button", name="small.jpg (2)")).to_be_visible()
    drag(label, (200, 100))
    expect(label.get_by_role("button", name="small.jpg (1)")).to_be_visible()
    label.get_by_label("Class").fill("door")
    label.get_by_label("Class").blur()
    expect(label.get_by_label("Its height")).to_have_value("2.0")
    save(label, pictures)
    small = read_folder(pictures).pictures[1]
    assert small.labels == (Label("door", 10, 20, 110, 220),)


def test_label_size_that_is_typed_before_the_class_is_kept(label: Page, pictures: Path) -> None:
    label.get_by_label("Its height").fill("1.5")
    label.get_by_label("Stands out").fill("0.3")
    label.get_by_label("Class").fill("cupboard")
    drag(label, (400, 300), (800, 900))
    expect(label.get_by_label("Its height")).to_have_value("1.5")
    save(label, pictures)
    assert read_folder(pictures).objects == (BeaconClass("cupboard", 1.5, 0.3),)


def test_label_size_in_centimetres_is_refused_and_not_saved(label: Page, pictures: Path) -> None:
    label.get_by_label("Class").fill("door")
    label.get_by_label("Its height").fill("200")
    for leave in (
        lambda: drag(label, (400, 300), (800, 900)),
        label.get_by_role("button", name="Save").click,
    ):
        label.evaluate("say('')")
        leave()
        expect(label.locator("#message")).to_have_text("200 is no size in metres; allowed: 0 to 10.")
    assert label.evaluate("unsaved")
    label.get_by_label("Its height").fill("2")
    save(label, pictures)
    assert read_folder(pictures).objects == (BeaconClass("door", 2.0),)


def test_label_message_goes_when_it_is_heeded_and_a_box_is_drawn_once(label: Page) -> None:
    message = label.locator("#message")
    drag(label, (400, 300), (800, 900))
    expect(message).to_have_text("Name a class first.")
    label.get_by_label("Class").fill("door")
    label.get_by_label("Class").blur()
    expect(message).to_have_text("Drag boxes. A click on a box removes it.")
    drag(label, (400, 300), (800, 900))
    drag(label, (405, 300), (800, 905))
    expect(message).to_have_text("There is a box of door already. A click on it removes it.")
    expect(label.get_by_role("button", name="large.png (1)")).to_be_visible()
    label.get_by_label("Class").fill("poster")
    drag(label, (400, 300), (800, 900))
    expect(label.get_by_role("button", name="large.png (2)")).to_be_visible()


def test_label_without_pictures_saves_nothing(page: Page) -> None:
    page.goto(PAGE.as_uri())
    page.get_by_role("button", name="Save labels.csv").click()
    expect(page.locator("#message")).to_have_text("Choose pictures first.")


def test_label_what_is_no_box_changes_nothing_and_says_why(label: Page, pictures: Path) -> None:
    drag(label, (400, 300), (800, 900))
    expect(label.locator("#message")).to_have_text("Name a class first.")
    label.mouse.move(5, 300)  # pressed beside the picture, let go on it
    label.mouse.down()
    label.mouse.move(500, 300)
    label.mouse.up()
    (pictures / "broken.png").write_text("no picture")
    (pictures / "other.csv").write_text("picture,class,x,y\nlarge.png,door,1,2\n")
    choose(label, pictures / "broken.png")
    expect(label.locator("#message")).to_contain_text("broken.png")
    choose(label, pictures / "other.csv")
    expect(label.locator("#message")).to_contain_text("other.csv: no labels in it")
    expect(label.get_by_role("button", name="large.png (0)")).to_be_visible()
    assert label.get_by_role("button", name="broken.png").count() == 0

"""Tests the player in a headless browser: pictures, poses of the runs, and most keys.

player_browser_test.py SUBSTEP SOURCE_FOLDER
"""

import base64
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
import textured_scene  # noqa: E402
from headless_browser import browser, expect, expect_no_network  # noqa: E402
from selenium.webdriver import ActionChains  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402

os.environ["XDG_CACHE_HOME"] = "/dev/null"  # no reference is kept from test to test

TITLE = 'a <b>"chain"</b> </script> & more'
# Functions of the page that the test calls: a panel's pixels, and the fraction of pixels in which two differ.
HELPERS = """
window.pixels = index => {
  player.layOut();
  const box = player.boxOf(player.panels[index].picture);
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [box[2], box[3]];
  const c = canvas.getContext('2d');
  const top = document.getElementById('pictures').height - box[1] - box[3];
  for (const id of ['pictures', 'marks']) c.drawImage(document.getElementById(id), -box[0], -top);
  return c.getImageData(0, 0, box[2], box[3]).data;
};
window.apart = (a, b) => {
  let count = 0;
  for (let i = 0; i < a.length; i += 4) if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) > 24) ++count;
  return count / (a.length / 4);
};
"""


class Page:
    def __init__(self, chrome, file):
        self.chrome = chrome
        chrome.get(file.as_uri() + "#t=0")
        end = time.time() + 60
        while not chrome.execute_script("return !!(window.player || document.getElementById('message'))"):
            expect(time.time() < end, "the page does not begin")
            time.sleep(0.05)
        chrome.execute_script(HELPERS)

    def script(self, text, *arguments):
        return self.chrome.execute_script(text, *arguments)

    def message(self):
        return self.script("return document.getElementById('message')?.textContent ?? ''")

    def key(self, *keys):
        chain = ActionChains(self.chrome)
        for key in keys:
            chain = chain.send_keys(key)
        chain.perform()

    def go(self, frame):
        self.script("player.go(arguments[0]); player.draw()", frame)

    def frame(self):
        return self.script("return player.frame")

    def keep(self, name, index=0):
        self.script("(window.kept ??= {})[arguments[0]] = pixels(arguments[1])", name, index)

    def apart(self, a, b):
        return self.script("return apart(kept[arguments[0]], kept[arguments[1]])", a, b)


def poses_of(file):
    """Returns the bodies of each frame from the run's log: x, y, z and the quaternion's w, x, y, z."""
    frames = []
    for line in file.read_text().splitlines():
        if line.startswith("frame "):
            frames.append([])
        elif line.startswith("pose "):
            frames[-1].append([float(word) for word in line.split()[2:]])
    return frames


def draws(page):
    """Bodies move, and the pictures of different runs differ."""
    expect(page.message() == "", f"the page says {page.message()}")
    page.keep("start")
    expect(page.script("return new Set(Array.from({length: kept.start.length / 4}, (_, i) => "
                       "kept.start[4 * i] << 8 | kept.start[4 * i + 1])).size") > 100, "WebGL drew one colour")
    page.keep("again")
    expect(page.apart("start", "again") == 0, "the same moment is not drawn alike")
    page.go(45)
    page.keep("later")
    page.keep("other", 1)
    page.keep("reference", 2)
    expect(page.apart("start", "later") > 0.002, f"scrubbing changes {page.apart('start', 'later')} of the picture")
    expect(min(page.apart("later", run) for run in ["other", "reference"]) > 0.001, "two runs are drawn alike")


def scrubs(page):
    page.key(Keys.HOME)
    expect(page.frame() == 0, "Home")
    page.key(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_LEFT)
    expect(page.frame() == 1, f"arrows: frame {page.frame()}")
    page.key(Keys.END)
    expect(page.frame() == 60, f"End: frame {page.frame()}")
    page.script("document.activeElement.blur()")
    strip = page.chrome.find_element(By.CSS_SELECTOR, ".strip")
    ActionChains(page.chrome).move_to_element(strip).click().perform()
    middle = page.script("return player.panels[0].strip.frameAt(arguments[0])", strip.rect["width"] / 2)
    expect(20 < page.frame() < 50 and abs(page.frame() - middle) <= 1, f"a click on a strip: frame {page.frame()}, not {middle}")
    page.script("const s = document.getElementById('scrubber'); s.value = 30; s.dispatchEvent(new Event('input'))")
    expect(page.frame() == 30, "the scrubber")
    page.script("player.draw()")
    expect(page.chrome.find_element(By.ID, "clock").text == "0.50 s", "the clock follows")
    # Frame 40 is at 0.6667 s, which the clock shows as 0.67 s.
    page.script("location.hash = '#t=0.67'")
    end = time.time() + 10
    while page.frame() != 40 and time.time() < end:
        time.sleep(0.05)
    expect(page.frame() == 40, f"another time in the address: frame {page.frame()}")


def shows_other_strips(page):
    def strip():
        page.script("player.draw()")
        return page.script("return player.panels[0].strip.canvas.toDataURL()")
    page.go(45)
    seen = [strip()]
    for name, words in [("gap", "60 Hz · strips: largest gap of a joint"), ("energy", "energy since the start")]:
        page.key("b")
        seen.append(strip())
        legend = page.chrome.find_element(By.ID, "legend").text
        expect(words in legend, f"the legend of {name} is '{legend}'")
        values = page.script("return player.panels[0].strip.values(player.data.panels[0])")
        expect(len(values) == 61, f"{name} of {len(values)} frames")
    expect(len(set(seen)) == 3, "the strips look alike")
    energies = page.script("return player.data.panels[0].energies")
    expect(energies[0] == 0 and any(value < 0 for value in energies), f"energies since the start: {energies[:3]} …")
    page.key("b")
    expect(strip() == seen[0], "the errors again")


def plays(page):
    page.go(0)
    page.script("document.getElementById('speed').value = 4")
    page.key(" ")
    end = time.time() + 30
    while page.frame() < 60 and time.time() < end:
        time.sleep(0.05)
    expect(page.frame() == 60, f"playing goes to the end, not {page.frame()}")
    expect(not page.script("return player.isPlaying"), "it stops at the end")
    page.script("document.getElementById('speed').value = 1")
    page.key(",", ",")
    expect(page.script("return +document.getElementById('speed').value") == 0.25, "slower by keys")


def tells_the_truth(page, run):
    """Poses equal the run's, and errors equal the film's."""
    # 2^30 + 1 quanta of 2^-18 m in groups of seven bits: 24 bits are too few for x.
    x = page.script("return posesFrom(new Uint8Array([130, 128, 128, 128, 8, 0, 0, 0, 0, 0, 0]), 0, 1, 2, 2 ** -18, 65536).values[7]")
    expect(x == 4096 + 2 ** -18, f"a position far from the origin is rounded to {x}")
    page.go(45)
    for frame in [0, 17, 60]:
        for body, row in enumerate(run[frame]):
            shown = page.script("return Array.from(poseAt(player.data, player.data.tracks[0], arguments[0], arguments[1]))", frame, body + 1)
            distance = max(abs(a - b) for a, b in zip(shown[:3], row[:3]))
            expect(distance <= page.script("return player.data.unit"), f"frame {frame}, body {body}: {distance} m off")
            turn = abs(sum(a * b for a, b in zip(shown[3:], row[4:] + row[3:4])))
            expect(abs(turn - 1) < 2e-5, f"frame {frame}, body {body}: a turn of cosine {turn} off")
    error, mean = page.script("""
        const {data} = player;
        const bodies = data.bodies.map((_, i) => i).filter(i => data.bodies[i].moves);
        const squares = bodies.map(i => bodyError(data, data.tracks[0], 45, i) ** 2);
        return [data.panels[0].errors[45], Math.sqrt(squares.reduce((a, b) => a + b) / bodies.length)];""")
    expect(error > 1e-3 and abs(error - mean) < 0.01 * error, f"errors: {mean} m from the poses, {error} m in the strip")


def overlays(page):
    page.keep("plain")
    for key in "tjge":
        page.key(key)
        page.keep(key)
        expect(page.apart("plain", key) > 2e-4, f"overlay {key} changes {page.apart('plain', key)} of the picture")
        page.key(key)
    page.keep("without")
    expect(page.apart("plain", "without") == 0, "overlays go again")


def camera(page):
    """Dragging in one panel turns all linked cameras, and the key resets them."""
    page.keep("other", 1)
    picture = page.chrome.find_element(By.CSS_SELECTOR, ".picture")
    ActionChains(page.chrome).move_to_element(picture).click_and_hold().move_by_offset(60, 20).release().perform()
    page.keep("turned")
    page.keep("other turned", 1)
    expect(page.apart("plain", "turned") > 0.005 and page.apart("other", "other turned") > 0.005, "a drag turns all panels")
    page.script("arguments[0].dispatchEvent(new WheelEvent('wheel', {deltaY: -300, cancelable: true}))", picture)
    page.keep("near")
    expect(page.apart("turned", "near") > 0.005, "the wheel zooms")
    page.key("r")
    page.keep("home")
    expect(page.apart("plain", "home") == 0, "r brings the film's camera back")
    width = picture.rect["width"]
    page.key("2")
    shown = [p for p in page.chrome.find_elements(By.CSS_SELECTOR, ".panel") if p.is_displayed()]
    expect(len(shown) == 1 and shown[0].rect["width"] > 1.5 * width, "2 shows the second panel alone")
    page.key("0")


def saves(page, folder):
    page.chrome.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(folder)})
    page.key("s")
    file = folder / "rod_chain_0.75s.png"
    end = time.time() + 30
    while not file.exists():
        expect(time.time() < end, f"no picture, but {list(folder.iterdir())}")
        time.sleep(0.05)
    content = file.read_bytes()
    expect(content[:8] == b"\x89PNG\r\n\x1a\n" and content[-8:-4] == b"IEND", "the picture is no PNG")
    width, height = struct.unpack(">II", content[16:24])
    expect(width == page.script("return innerWidth") and height > 200, f"the picture has {width}×{height} pixels")
    expect(len(content) > 20000, f"the picture has {len(content)} bytes")


def escapes(page):
    expect(page.chrome.title == TITLE, f"the title is {page.chrome.title}")
    expect(page.chrome.find_element(By.TAG_NAME, "h1").text == TITLE, "the heading is the title")
    heads = [" ".join(head.text.split()) for head in page.chrome.find_elements(By.CSS_SELECTOR, ".head")]
    expect(heads == ["A5 2 sub-steps", "A2 2 iterations", "Reference"], f"panels: {heads}")


def pixels_of_png(page, content, places):
    """Returns RGB at each position (x, y) of a picture, as the browser decodes it."""
    return page.chrome.execute_async_script("""
        const [file, places, done] = arguments;
        const image = new Image();
        image.onload = () => {
          const canvas = document.createElement('canvas');
          [canvas.width, canvas.height] = [image.width, image.height];
          const c = canvas.getContext('2d');
          c.drawImage(image, 0, 0);
          done(places.map(([x, y]) => Array.from(c.getImageData(x, y, 1, 1).data.slice(0, 3))));
        };
        image.src = 'data:image/png;base64,' + file;""", base64.b64encode(content).decode(), places)


def shows_materials(chrome, folder, substep):
    """Squares with all properties of materials have the renderer's colours."""
    textured_scene.write(folder / "squares.gltf")
    width, height = 640, 360
    for arguments in [["player", "squares.gltf", "--duration", "0.1", "--fps", "240", "--panel", "a5,n=2", "--output",
                       "squares.html"],
                      ["render", "squares.gltf", "--time", "0", "--size", f"{width}x{height}", "--output", "squares.png"]]:
        subprocess.run([substep, *arguments], cwd=folder, check=True, capture_output=True)
    page = Page(chrome, folder / "squares.html")
    expect(page.message() == "", f"the page says {page.message()}")
    sides = page.script("return player.data.images.map(image => Math.max(image.width, image.height))")
    expect(sorted(sides)[-1] == 512, f"images have sides of {sides} pixels: the large one is halved to 512")
    page.go(1)
    expect(page.chrome.find_element(By.ID, "clock").text == "0.004 s", "the clock tells frames of 240 Hz apart")
    points = [place for _, place in textured_scene.quarters()]
    names = [name for name, _ in textured_scene.quarters()]
    page.go(0)
    page.keep("squares")
    shown = page.script("""
        player.layOut();
        const box = player.boxOf(player.panels[0].picture);
        const view = player.camera.view(box);
        return arguments[0].map(point => {
          const [x, y] = projected(view, point, box[2], box[3]).map(Math.floor);
          return Array.from(kept.squares.slice(4 * (y * box[2] + x), 4 * (y * box[2] + x) + 3));
        });""", points)
    # As seen by the scene's camera, from which the page's may have stepped back.
    eye, tangent = textured_scene.EYE, math.tan(textured_scene.FIELD_OF_VIEW / 2)
    scale = [height / 2 / (tangent * (eye[2] - z)) for _, _, z in points]
    places = [(int(width / 2 + s * (x - eye[0])), int(height / 2 - s * (y - eye[1]))) for s, (x, y, _) in zip(scale, points)]
    drawn = pixels_of_png(page, (folder / "squares.png").read_bytes(), places)
    for name, place, is_shown, should in zip(names, points, shown, drawn):
        off = max(abs(a - b) for a, b in zip(is_shown, should))
        expect(off <= 4, f"{name} at {place} is {is_shown}, in the renderer's picture {should}")


def without_webgl(chrome, file):
    """Without WebGL the page shows all but the pictures, and says why."""
    mark = chrome.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": """
        const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function(kind, ...rest) { return kind === 'webgl2' ? null : get.call(this, kind, ...rest); };"""})
    chrome.get("about:blank")
    page = Page(chrome, file)
    chrome.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", mark)
    expect("WebGL 2" in page.message(), f"without WebGL the page says '{page.message()}'")
    page.key(Keys.ARROW_RIGHT)
    expect(page.frame() == 1, "without WebGL time goes on")


def main():
    substep, source = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scene = str(pathlib.Path(source) / "scenes/rod_chain.gltf")
        for arguments in [["player", scene, "--duration", "1", "--panel", "a5,n=2,joints=plain", "--panel", "a2,m=2", "--panel", "reference",
                           "--title", TITLE, "--output", "chain.html"],
                          ["run", scene, "--duration", "1", "--algorithm", "a5", "--set", "n=2,joints=plain", "--output", "a.poses.txt"]]:
            subprocess.run([substep, *arguments], cwd=folder, check=True, capture_output=True)
        # Software WebGL: slow, so the window is small.
        chrome = browser("760,420", ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        try:
            page = Page(chrome, folder / "chain.html")
            escapes(page)
            draws(page)
            scrubs(page)
            shows_other_strips(page)
            plays(page)
            tells_the_truth(page, poses_of(folder / "a.poses.txt"))
            overlays(page)
            camera(page)
            saves(page, folder)
            shows_materials(chrome, folder, substep)
            expect_no_network(chrome)
            without_webgl(chrome, folder / "chain.html")
        finally:
            chrome.quit()


main()

"""Puts the page's styles, scripts and the WebAssembly binary into one file that a browser opens by itself."""

import base64
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def inlined(page: str, wasm: bytes) -> str:
    """The page with the text of each file that it names in place of the reference."""

    def style(match: re.Match[str]) -> str:
        return f"<style>\n{(HERE / match[1]).read_text(encoding='utf-8')}</style>"

    def script(match: re.Match[str]) -> str:
        return f"<script>\n{(HERE / match[1]).read_text(encoding='utf-8')}</script>"

    page = re.sub(r'<link rel="stylesheet" href="(.*?)">', style, page)
    page = re.sub(r'<script src="(.*?)"></script>', script, page)
    return page.replace("BSLAM_WASM_BASE64", base64.b64encode(wasm).decode())


def main(wasm: str, out: str) -> int:
    page = (HERE / "page.html").read_text(encoding="utf-8")
    target = Path(out)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(inlined(page, Path(wasm).read_bytes()), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

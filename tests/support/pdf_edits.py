"""Change PDF files as somebody would who knows the format: what they say fits together again."""

import base64
import re
import zlib


def repaired(data):
    """Return a PDF whose lengths and table are right again after its objects were changed."""

    def length(match):
        return b"/Length %d" % len(match[2]) + match[1] + b"stream\n" + match[2] + b"endstream"

    stream = rb"/Length \d+((?:(?!endobj|stream)[\s\S])*?>>\s*?)stream\n(.*?)endstream"
    data = re.sub(stream, length, data, flags=re.DOTALL)
    body, rest = data[: data.rindex(b"\nxref\n") + 1], data[data.rindex(b"\ntrailer") :]
    places = [match.start() for match in re.finditer(rb"^\d+ 0 obj", body, re.MULTILINE)]
    table = b"".join(b"%010d 00000 n \n" % place for place in places)
    rest = re.sub(rb"startxref\n\d+", b"startxref\n%d" % len(body), rest)
    rest = re.sub(rb"/Size \d+", b"/Size %d" % (len(places) + 1), rest)
    head = b"xref\n0 %d\n0000000000 65535 f \n" % (len(places) + 1)
    return body + head + table.rstrip(b"\n") + rest


def unpacked(data):
    """Return a PDF with its pages and forms as they are drawn, to be changed."""

    def plain(match):
        content = match[3]
        if b"/Subtype /Image" in match[1]:
            return match[0]
        if b"ASCII85" in match[1]:
            content = base64.a85decode(content.strip().removesuffix(b"~>"))
        content = zlib.decompress(content)
        text = re.sub(rb"/Filter \[[^\]]*\] ", b"", match[1])
        text = re.sub(rb"/Length \d+", b"/Length %d" % len(content), text)
        return text + match[2] + b"stream\n" + content + b"\nendstream"

    pattern = rb"(<<(?:(?!endobj|stream)[\s\S])*?/Length \d+(?:(?!endobj|stream)[\s\S])*?)(>>\s*?)"
    return repaired(
        re.sub(pattern + rb"stream\r?\n([\s\S]*?)endstream", plain, data).replace(
            b"\nstream\n", b" stream\n"
        )
    )

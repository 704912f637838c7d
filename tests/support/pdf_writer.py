"""Write plain PDFs, as strictly as the makers' are."""


def pdf_bytes(*pages: bytes, filters: bytes = b"") -> bytes:
    """Return a PDF of pages that draw these contents, which may be packed as ``filters`` say."""
    count = len(pages)
    kids = b" ".join(b"%d 0 R" % (3 + 2 * n) for n in range(count))
    objects = [
        b"<<\n/PageMode /UseNone /Pages 2 0 R /Type /Catalog\n>>",
        b"<<\n/Count %d /Kids [ %s ] /Type /Pages\n>>" % (count, kids),
    ]
    for number, content in enumerate(pages):
        objects.append(
            b"<<\n/Contents %d 0 R /MediaBox [ 0 0 595 842 ] /Parent 2 0 R /Type /Page\n>>"
            % (4 + 2 * number)
        )
        objects.append(
            b"<<\n%s /Length %d\n>>\nstream\n%s\nendstream" % (filters, len(content), content)
        )
    data, places = b"%PDF-1.4\n", []
    for number, body in enumerate(objects, start=1):
        places.append(len(data))
        data += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    table = b"".join(b"%010d 00000 n \n" % place for place in places)
    return data + (
        b"xref\n0 %d\n0000000000 65535 f \n%strailer\n<<\n/Root 1 0 R\n/Size %d\n>>\n"
        b"startxref\n%d\n%%%%EOF\n"
    ) % (len(objects) + 1, table, len(objects) + 1, len(data))

"""Pictures of a folder: which can be read, which are blurred, dark, the same; and how they are written upright for COLMAP and the reader.

COLMAP and `twin reconstruct` take pixels as they lie in the file, whatever its EXIF orientation says, so that each picture is turned here.
"""
import hashlib
import os
import re
import shutil

import cv2
import numpy as np
from PIL import ExifTags, Image, ImageOps

FEWEST = 8  # pictures with which `twin reconstruct` begins
LARGEST = 250e6  # pixels; what says that it has more is taken for damaged
Image.MAX_IMAGE_PIXELS = None  # LARGEST is asked instead
ENDINGS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
LOOKED_AT = 640  # columns or rows of a picture in which sharpness is measured
BESIDE = 4  # pictures before and after, which a picture is compared with
BLURRED, BLURRED_ALL = 0.8, 1.2  # sharpness against that of the pictures beside it, and by itself, below which a picture is blurred
EVEN = 4  # differences of grey in a picture of nothing
DARK, BRIGHT = 30, 0.4  # grey that 95 % of the pixels stay below; share of pixels that are white


class Refused(Exception):
    """What a person has to change, in one sentence."""


def natural(name):
    """Sorts IMG_9 before IMG_10: the order in which pictures were taken."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.split(r"(\d+)", name.lower())] + [(2, 0, name)]


def some(names, most=3):
    """The first of some names, and how many more there are."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def listed(folder, note):
    """Paths of the pictures of a folder in the order in which they were taken; what is passed over is said."""
    entries = [name for name in os.listdir(folder) if not name.startswith(".")]
    paths = {name: os.path.join(folder, name) for name in sorted(entries, key=natural)}
    files = [name for name, path in paths.items() if os.path.isfile(path)]
    heic = [name for name in files if os.path.splitext(name)[1].lower() in (".heic", ".heif")]
    taken = [name for name in files if os.path.splitext(name)[1].lower() in ENDINGS]
    if heic and not taken:
        raise Refused(f"{folder}: {some(heic)} are HEIC, which is not read here: make JPEG files of them with `heif-convert IN.HEIC OUT.jpg` "
                      "(Debian's package libheif-examples), or set the phone's camera to JPEG")
    if heic:
        raise Refused(f"{folder}: {some(heic)} are HEIC, which is not read here: take them out of the folder, or make JPEG files of them with "
                      "`heif-convert IN.HEIC OUT.jpg` (Debian's package libheif-examples)")
    inner = [name for name, path in paths.items() if os.path.isdir(path) and name not in ("masks", "mask")]
    if inner and not taken:
        raise Refused(f"{folder}: no PNG or JPEG picture, but folders ({some(inner)}); give the one that holds the pictures")
    if not taken:
        raise Refused(f"{folder}: no PNG or JPEG picture")
    others = [name for name in files if name not in taken and name.lower() not in ("thumbs.db", "desktop.ini")]
    if inner:
        note(f"folders inside of {folder} are not looked into: {some(inner)}")
    if others:
        note(f"{some(others)}: neither PNG nor JPEG by their endings, left out")
    return [paths[name] for name in taken]


def gradients(grey, sigma):
    """What the steepest 2 % of the pixels begin with, along four directions, in a picture smoothed by so much."""
    smooth = cv2.GaussianBlur(grey, (0, 0), sigma)
    x, y = cv2.Sobel(smooth, cv2.CV_32F, 1, 0)[::2, ::2], cv2.Sobel(smooth, cv2.CV_32F, 0, 1)[::2, ::2]
    turn = 0.5 ** 0.5
    return np.array([np.quantile(np.abs(along), 0.98) for along in (x, turn * (x + y), y, turn * (y - x))])


def sharpness(grey):
    """How steep edges are along each of four directions, a number for each: from 1, blurred, to 3.

    As the variance of the Laplacian (Pech-Pacheco et al. 2000) it asks for the finest edges; but noise raises that one, and so does what
    the picture shows. Here the steepest edges are held against the same ones smoothed, as blur is found by blurring again (Crete et al.
    2007), along four directions, because a camera that moves blurs along its way alone.
    """
    return gradients(grey, 1.0) / np.maximum(gradients(grey, 3.0), 1e-3)


def blurred(sharp):
    """Which of the pictures, sharpness [pictures, 4] in the order in which they were taken, are blurred."""
    sharp, out = np.asarray(sharp, float).reshape(-1, 4), []
    for at, own in enumerate(sharp):
        beside = np.delete(sharp[max(0, at - BESIDE):at + BESIDE + 1], min(at, BESIDE), axis=0)
        less = len(beside) and (own / np.median(beside, axis=0)).min() < BLURRED
        out.append(bool(less or own.mean() < BLURRED_ALL))
    return out


def spread(sharp, every):
    """Numbers of the sharpest of each `every` pictures in a row."""
    worth = np.asarray(sharp, float).reshape(-1, 4).min(axis=1)
    return [start + int(np.argmax(worth[start:start + every])) for start in range(0, len(worth), every)]


def eight_bits(image):
    """The picture with 8 bits a channel; Pillow itself cuts off what 16 bits of grey say."""
    if not image.mode.startswith(("I", "F")):
        return image
    return Image.fromarray((np.asarray(image, np.float64) / 257).clip(0, 255).astype(np.uint8))


def grey_of(image):
    """An upright picture in grey, small, as sharpness and light are measured in it."""
    share = LOOKED_AT / max(image.size)
    small = image.convert("L")
    if share < 1:
        small = small.resize([max(1, round(side * share)) for side in image.size], Image.Resampling.BOX)
    return np.asarray(small, np.float32)


def focal_share(exif, size):
    """Focal length as a share of the longer side by the EXIF numbers, and what tells one zoom of a camera from another; None unknown."""
    inside = exif.get_ifd(ExifTags.IFD.Exif)
    number = lambda tag: float(inside.get(tag) or 0.0)
    try:
        base = ExifTags.Base
        of_35, length, zoom = map(number, (base.FocalLengthIn35mmFilm, base.FocalLength, base.DigitalZoomRatio))
    except (TypeError, ValueError, ZeroDivisionError):
        return None, None
    # The 35 mm focal length is that of a film with the same diagonal, 43.27 mm.
    share = of_35 / 43.27 * float(np.hypot(*size)) / max(size) if 5 < of_35 < 1000 else None
    return share, (round(of_35), round(length, 1), round(zoom, 1))


class Picture:
    """One picture: where it lies, what was measured, what it is called in the scan."""

    def __init__(self, path):
        self.path, self.file = path, os.path.basename(path)
        with open(path, "rb") as stream:
            content = stream.read()
        if not content:
            raise ValueError("is empty")
        self.same = hashlib.sha256(content).digest()
        try:
            with Image.open(path) as image:
                self.format, self.mode, self.raw = image.format, image.mode, image.size
                if image.format not in ("PNG", "JPEG", "MPO"):
                    raise ValueError(f"is {image.format}, not PNG or JPEG")
                if image.size[0] * image.size[1] > LARGEST:
                    raise ValueError(f"has {image.size[0]} x {image.size[1]} pixels, too many")
                exif = image.getexif()
                self.turned = exif.get(ExifTags.Base.Orientation, 1)
                upright = eight_bits(ImageOps.exif_transpose(image))
        except ValueError:
            raise
        except Exception as error:  # of a decoder, which has many
            raise ValueError(f"cannot be read ({str(error).splitlines()[0][:100] if str(error) else type(error).__name__})") from error
        self.size = upright.size
        self.focal, self.zoom = focal_share(exif, self.size)
        grey = grey_of(upright)
        if np.ptp(np.quantile(grey, [0.01, 0.99])) < EVEN:
            raise ValueError("shows nothing but one even colour")
        self.sharp, self.dark, self.bright = sharpness(grey), bool(np.quantile(grey, 0.95) < DARK), bool((grey > 250).mean() > BRIGHT)
        self.alpha = ENDINGS[ending(self.file)] == "PNG" and has_alpha(upright)
        self.name, self.mask, self.goal = self.file, mask_of(path), self.size

    def written(self, folder, longest):
        """Writes the picture upright, the longer side at most `longest` (0: as it is); gives its size there."""
        share = longest / max(self.size) if longest else 1.0
        goal = os.path.join(folder, self.name)
        plain = self.turned in (0, 1) and share >= 1 and self.mode in ("RGB", "RGBA", "L") and ENDINGS[ending(self.name)] == self.format
        if plain:
            shutil.copyfile(self.path, goal)
            return self.size
        with Image.open(self.path) as image:
            upright = eight_bits(ImageOps.exif_transpose(image))
        upright = upright.convert("RGBA" if self.alpha else "RGB")
        if share < 1:
            upright = upright.resize([max(1, round(side * share)) for side in self.size], Image.Resampling.LANCZOS)
        clean = Image.new(upright.mode, upright.size)  # without EXIF
        clean.paste(upright)
        clean.save(goal, format=ENDINGS[ending(self.name)], **({} if ENDINGS[ending(self.name)] == "PNG" else {"quality": 96, "subsampling": 0}))
        return clean.size

    def written_mask(self, goal, size):
        """Writes the mask as it belongs to the picture written with that size."""
        with Image.open(self.mask or self.path) as image:
            mask = image.convert("RGBA").getchannel("R") if self.mask else ImageOps.exif_transpose(image).convert("RGBA").getchannel("A")
        if mask.size != self.size and mask.size == self.raw:
            with Image.open(self.path) as picture:  # drawn on the pixels as they lie in the file
                mask.getexif()[ExifTags.Base.Orientation] = picture.getexif().get(ExifTags.Base.Orientation, 1)
            mask = ImageOps.exif_transpose(mask)
        if mask.size not in (self.size, size):
            raise Refused(f"{self.mask} has {mask.size[0]} x {mask.size[1]} pixels, its picture {self.size[0]} x {self.size[1]}; "
                          "draw the mask on the picture itself, or take it away")
        mask.resize(size, Image.Resampling.BOX).save(goal, format="PNG")


def has_alpha(image):
    return image.mode in ("LA", "PA", "RGBA") or "transparency" in image.info


def ending(name):
    return os.path.splitext(name)[1].lower()


def mask_of(path):
    """The mask beside a picture, or None: masks/NAME.png in its folder or beside it."""
    folder, file = os.path.split(os.path.abspath(path))
    for place in (folder, os.path.dirname(folder)):
        for name in (file + ".png", os.path.splitext(file)[0] + ".png"):
            found = os.path.join(place, "masks", name)
            if os.path.isfile(found):
                return found
    return None


def chosen(paths, every, blurred_too, note):
    """Pictures that can be used, after damaged ones, copies and blurred ones are left out; all that is said with names."""
    read, unread, copies, seen = [], [], [], {}
    for count, path in enumerate(paths):
        if count and count % 25 == 0:
            note(f"looks at the pictures: {count} of {len(paths)}")
        try:
            picture = Picture(path)
        except (ValueError, OSError) as error:
            unread.append(f"{os.path.basename(path)} {error.strerror if isinstance(error, OSError) else error}")
            continue
        before = seen.get(picture.same)
        if before is None:
            seen[picture.same] = len(read)
            read.append(picture)
            continue
        if picture.mask and not read[before].mask:  # of two copies, the one with a mask
            picture, read[before] = read[before], picture
        copies.append(f"{picture.file} (of {read[before].file})")
    for line in unread:
        note(f"{line}: left out")
    if copies:
        note(f"left out as copies of another picture, byte for byte: {some(copies)}")
    if every > 1 and read:
        read = [read[at] for at in spread([picture.sharp for picture in read], every)]
    if len(read) < FEWEST:
        raise Refused(f"{len(read)} pictures can be used, {FEWEST} are the least and forty to eighty are good: take more from all sides"
                      + (", or a smaller --every" if every > 1 else ""))
    marks = [mark and not blurred_too for mark in blurred([picture.sharp for picture in read])]
    bad = [picture.file for picture, mark in zip(read, marks) if mark]
    kept = [picture for picture, mark in zip(read, marks) if not mark]
    if 2 * len(bad) > len(read):
        raise Refused(f"{len(bad)} of {len(read)} pictures are blurred ({some(bad)}): hold the camera still while each is taken, "
                      "have more light, and touch the object on the screen so that it is in focus; --blurred takes them all the same")
    if bad:
        note(f"left out as blurred, compared with the pictures before and after: {some(bad, 8)}; --blurred takes them all the same")
    return kept, {"unread": unread, "copies": copies, "blurred": bad}

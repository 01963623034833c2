"""The size of a run: a full one, or a quick one of about a minute."""

from __future__ import annotations

from dataclasses import dataclass

from . import subjects


@dataclass
class Settings:
    """Counts are per volume unless stated otherwise."""

    quick: bool = False
    size: tuple[int, int] = (1024, 1024)  # of the image whose primary rays are cast, multiples of 4
    repetitions: int = 5  # of everything that is timed; the median counts
    threads: int = 1  # of the rows that compare rates of rays; 0 for all
    volumes: str = ""  # only real volumes whose file name holds this; "none" for procedural ones
    procedural_size: int = 256  # samples along each axis where there are no real volumes
    incoherent_rays: int = 1_000_000
    agreement_rays: int = 1_000_000
    accuracy_rays: int = 100_000  # at each distance of the eye
    escape_rays: int = 1_000_000
    points: int = 100_000  # at each distance from the surface
    growth_sizes: tuple[int, ...] = (64, 128, 256, 512, 768)
    level_sizes: tuple[int, ...] = (256, 512)
    large_size: int = 1024  # samples along each axis of the volume of `large`
    prefilter_sizes: tuple[int, ...] = (256, 512)
    store_tiles: tuple[int, ...] = (1, 2, 4, 8)  # of 256^3 samples, along each axis

    @classmethod
    def for_a_minute(cls):
        return cls(
            quick=True,
            size=(256, 256),
            repetitions=3,
            volumes="none",
            procedural_size=64,
            incoherent_rays=50_000,
            agreement_rays=20_000,
            accuracy_rays=500,
            escape_rays=20_000,
            points=5_000,
            growth_sizes=(32, 64, 128),
            level_sizes=(64,),
            large_size=96,
            prefilter_sizes=(96,),
            store_tiles=(1,),
        )

    def subjects(self):
        """Real volumes of 128^3 cells or more, one at a time; procedural ones where there are none."""
        found = False
        for subject in subjects.real(self.volumes) if self.volumes != "none" else ():
            if subject.data.size >= 128**3:
                found = True
                yield subject
        if not found:
            yield from subjects.procedural(("gyroid", "heart"), (self.procedural_size,))

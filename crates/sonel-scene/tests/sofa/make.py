#!/usr/bin/env python3
"""Makes the SOFA files in this folder: `pip install sofar==1.3.0 netCDF4==1.7.2`, then `python make.py`.

The first three are one source, measured differently. Its energy in the direction (x ahead, y left, z up) is 1 + s (0.4 x + 0.25 y + 0.15 z) at
1 m: s is 0.8, 1.0, 1.2 at 400, 500, 630 Hz and -0.5 from 800 Hz on. Phases are random.
"""

from pathlib import Path

import netCDF4
import numpy as np
import sofar

FOLDER = Path(__file__).parent
FREQUENCIES = np.array([400.0, 500, 630, 800, 1000, 1250])
STRENGTHS = np.array([0.8, 1.0, 1.2, -0.5, -0.5, -0.5])
AZIMUTHS, ELEVATIONS = np.arange(0, 360, 30.0), np.arange(-90, 91, 30.0)


def unit(azimuth, elevation):
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)


def spectra(directions, distances=1.0):
    """Complex, by direction and frequency."""
    energy = 1 + (directions @ [0.4, 0.25, 0.15])[..., None] * STRENGTHS
    phase = np.exp(2j * np.pi * np.random.default_rng(1).random(energy.shape))
    return np.sqrt(energy) * phase / np.broadcast_to(distances, energy.shape[:-1])[..., None]


def around():
    """Azimuth and elevation of a grid, the poles once for each azimuth."""
    azimuth, elevation = np.meshgrid(AZIMUTHS, ELEVATIONS, indexing="ij")
    return azimuth.ravel(), elevation.ravel()


def by_netcdf(name, values, receivers, kind="spherical", units="degree, degree, metre", convention="FreeFieldDirectivityTF", **stations):
    """The least that a directivity has."""
    measurements, count, length = values.shape
    with netCDF4.Dataset(FOLDER / f"{name}.sofa", "w", format="NETCDF4") as file:
        file.setncatts({"Conventions": "SOFA", "Version": "2.1", "SOFAConventions": convention, "DataType": "TF"})
        for dimension, size in {"I": 1, "C": 3, "R": count, "E": 1, "M": measurements, "N": length}.items():
            file.createDimension(dimension, size)

        def variable(name, dimensions, values, **attributes):
            made = file.createVariable(name, "f8", dimensions, zlib=True)
            made[:] = values
            made.setncatts(attributes)

        variable("N", ("N",), FREQUENCIES[:length], LongName="frequency", Units="hertz")
        variable("ReceiverPosition", ("R", "C", "I"), np.asarray(receivers)[..., None], Type=kind, Units=units)
        for station, rows in stations.items():
            variable(station, ("M" if len(rows) > 1 else "I", "C"), rows, Type="cartesian", Units="metre")
        variable("Data.Real", ("M", "R", "N"), values.real)
        variable("Data.Imag", ("M", "R", "N"), values.imag)


def turned():
    """The source looks up, the array of microphones to the left; both are off the origin, and distances differ."""
    sofa = sofar.Sofa("FreeFieldDirectivityTF")
    directions = unit(*around())
    distances = np.where(np.arange(len(directions)) % 2, 1.5, 3.0)
    sofa.Data_Real, sofa.Data_Imag = (part[None] for part in (spectra(directions, distances).real, spectra(directions, distances).imag))
    sofa.N = FREQUENCIES
    ahead, up = np.array([0.0, 0, 1]), np.array([-1.0, 0, 0])
    places = [5, 1, 2] + distances[:, None] * directions @ np.stack([ahead, np.cross(up, ahead), up])
    view, listener_up = np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
    local = (places - [4, 1, 0]) @ np.stack([view, np.cross(listener_up, view), listener_up]).T
    sofa.ReceiverPosition, sofa.ReceiverPosition_Type, sofa.ReceiverPosition_Units = local, "cartesian", "metre"
    sofa.ListenerPosition, sofa.ListenerView, sofa.ListenerUp = [4, 1, 0], view, listener_up
    sofa.SourcePosition, sofa.SourceView, sofa.SourceUp = [5, 1, 2], 2 * ahead, up
    sofa.GLOBAL_DateCreated = sofa.GLOBAL_DateModified = "2026-01-01 00:00:00"
    sofar.write_sofa(FOLDER / "turned.sofa", sofa)


azimuth, elevation = around()
places = np.stack([azimuth, elevation, np.ones_like(azimuth)], axis=1)
by_netcdf("spherical", spectra(unit(azimuth, elevation))[None], places)
turned()
# A semicircle of microphones ahead of a turntable.
turns = np.stack([unit(-turn, ELEVATIONS) for turn in AZIMUTHS])
semicircle = np.stack([0 * ELEVATIONS, ELEVATIONS, 0 * ELEVATIONS + 1], axis=1)
by_netcdf("turntable", spectra(turns), semicircle, SourceView=unit(AZIMUTHS, 0 * AZIMUTHS), SourceUp=[[0, 0, 1]])
# What is refused.
upper = elevation >= 0
by_netcdf("half", spectra(unit(azimuth, elevation))[None][:, upper], places[upper])
by_netcdf("radians", spectra(unit(azimuth, elevation))[None], places, units="radian, radian, metre")
by_netcdf("hrtf", spectra(unit(azimuth, elevation))[None], places, convention="SimpleFreeFieldHRTF")
silent = spectra(unit(azimuth, elevation))[None]
silent[0, 7, 2] = np.nan
by_netcdf("not-finite", silent, places)
by_netcdf("at-the-source", spectra(unit(azimuth, elevation))[None], 0 * places)
by_netcdf("upright", spectra(unit(azimuth, elevation))[None], places, SourceView=[[0, 0, 1]], SourceUp=[[0, 0, 2]])

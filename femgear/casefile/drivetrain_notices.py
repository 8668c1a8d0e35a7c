"""What a drivetrain case is allowed to say but deserves a look."""

from __future__ import annotations

from collections.abc import Iterator

from femgear.casefile.drivetrain import DrivetrainCase

# Ratios of radii and teeth that differ by more are worth a remark.
_REMARK = 1e-4


def notices(case: DrivetrainCase) -> tuple[str, ...]:
    """Remarks on a case that was checked."""
    found = []
    for i, stage in enumerate(case.parallel):
        radii = stage.radii or stage.base_radii
        if radii:
            found.append((f"parallel[{i}]", radii[1] / radii[0], stage.teeth[1] / stage.teeth[0]))
    for i, stage in enumerate(case.planetary):
        for sun, planet in (
            (stage.sun_radius, stage.planet_radius),
            (stage.sun_base_radius, stage.planet_base_radius),
        ):
            if sun is not None:
                found.append(
                    (f"planetary[{i}]", 1.0 + 2.0 * planet / sun, stage.ring_teeth / stage.sun_teeth)
                )
    said = [
        f"[W-TEETH] {key}.teeth: the teeth have the ratio {teeth:.5g}, the radii {radii:.5g}; speeds follow "
        "the radii, mesh frequencies the teeth of the first gear or of the ring"
        for key, radii, teeth in found
        if abs(teeth / radii - 1.0) > _REMARK
    ]
    if not case.bearing:
        said.append("[W-BEARING] there is no [[bearing]]")
    return (*said, *_open_backs(case))


def _open_backs(case: DrivetrainCase) -> Iterator[str]:
    """Meshes whose teeth part but find no back flank."""
    if not case.simulation.contact_loss:
        return
    meshes = [(f"parallel[{i}].mesh", one.mesh) for i, one in enumerate(case.parallel)]
    for i, one in enumerate(case.planetary):
        meshes += [(f"planetary[{i}].sun_mesh", one.sun_mesh), (f"planetary[{i}].ring_mesh", one.ring_mesh)]
    if bare := [key for key, mesh in meshes if mesh.backlash is None]:
        yield (
            f"[W-BACKLASH] {', '.join(bare)}: without backlash given there is no back side: with "
            "simulation.contact_loss these teeth part and meet no back flank"
        )
    if not meshes:
        yield "[W-BACKLASH] simulation.contact_loss: there are no meshes that could part"

"""Writes types.npz, by NumPy itself, and packed.npz, the same compressed: arrays of every type that `compare` reads, and of others."""

import io
import zipfile

import numpy as np

values = [1, 0, 1, 1]
arrays = {"time": np.array([1.0, 2.0, 3.0, 4.0]), "relative_velocity": np.ones(4)}
for order in "<>":
    for kind in ["f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"]:
        name = {"<": "little_", ">": "big_"}[order] + kind
        arrays[name] = np.array(values, dtype=order + kind)
arrays["truth"] = np.array(values, dtype=bool)
wide = np.array([[7, v, 7] for v in values], dtype=float)
arrays["wide"], arrays["fortran"] = wide, np.asfortranarray(wide)
arrays["column"] = wide[:, 1:2].copy()
arrays["complex"] = np.array(values, dtype=complex)
arrays["long"] = np.array(values, dtype=np.longdouble)
arrays["object"] = np.array(values, dtype=object)
arrays["dates"] = np.array(values, dtype="M8[ns]")
arrays["raw"] = np.zeros(4, dtype="V3")
arrays["texts"] = np.array(["stick", "slip", "é", ""])
arrays["bytes"] = np.array([b"stick", b"slip", b"", b"x"])
arrays["empty"] = np.zeros((0, 5))
arrays["single"] = np.array(1.0)
fields = [("a", "<f8"), ("b", [("c", "i4"), ("d'\"\\é", "u1")], (2, 3)), (("title", "x"), "?")]
arrays["records"] = np.zeros(4, dtype=fields)
arrays["greek"] = np.zeros(4, dtype=[("ω", ">i2")])
arrays["padded"] = np.zeros(4, dtype={"names": ["a"], "formats": ["f8"], "offsets": [8], "itemsize": 24})

for name, method in [("types.npz", zipfile.ZIP_STORED), ("packed.npz", zipfile.ZIP_DEFLATED)]:
    with zipfile.ZipFile(name, "w", method) as archive:
        for key, array in arrays.items():
            for version in [None, (2, 0), (3, 0)]:
                # Each array in the version that NumPy takes, and one in the others, too.
                if version and key != "little_f8":
                    continue
                data = io.BytesIO()
                np.lib.format.write_array(data, array, version=version)
                member = zipfile.ZipInfo(key + (f"_{version[0]}" if version else "") + ".npy")
                member.compress_type = method
                archive.writestr(member, data.getvalue())

# ifc2obj.py IN.ifc OUT.obj
import sys, ifcopenshell, ifcopenshell.geom
from ifcopenshell.util.element import get_aggregate, get_materials

LEFT_OUT = {"IfcSpace", "IfcOpeningElement", "IfcSite", "IfcFurnishingElement"}
model = ifcopenshell.open(sys.argv[1])
settings = ifcopenshell.geom.settings()
settings.set("use-world-coords", True)
shapes = ifcopenshell.geom.iterator(settings, model)
count = 0
with open(sys.argv[2], "w") as out:
    shapes.initialize()
    while True:
        shape = shapes.get()
        verts, faces = shape.geometry.verts, shape.geometry.faces
        element = model.by_id(shape.id)
        if element.is_a("IfcSpace"):
            corners = [verts[axis::3] for axis in range(3)]
            middle = [round((min(at) + max(at)) / 2, 2) for at in corners]
            storey = get_aggregate(element)
            print(f"air_at = [{middle}]    # {storey.Name}: {element.LongName or element.Name}")
        if element.is_a() not in LEFT_OUT:
            for i in range(0, len(verts), 3):
                print("v %.9g %.9g %.9g" % tuple(verts[i:i + 3]), file=out)
            names = [material.Name for material in get_materials(element)]
            print("usemtl", " and ".join(names) or element.is_a(), file=out)
            for i in range(0, len(faces), 3):
                print("f", *[count + 1 + corner for corner in faces[i:i + 3]], file=out)
            count += len(verts) // 3
        if not shapes.next():
            break

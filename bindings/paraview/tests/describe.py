"""Run by pvbatch: writes what ParaView's windows and scripts show of Marrow Contour and of Contour to a JSON file.

usage: describe.py PLUGIN OUTPUT
"""

import json
import sys

from paraview import servermanager, simple


def menu_of(prototype):
    hints = prototype.GetHints()
    menu = hints and hints.FindNestedElementByName("ShowInMenu")
    return menu.GetAttribute("category") if menu else None


def describe(name):
    prototype = servermanager.ProxyManager().GetPrototypeProxy("filters", name)
    properties = {}
    iterator = prototype.NewPropertyIterator()
    iterator.Begin()
    while not iterator.IsAtEnd():
        found = iterator.GetProperty()
        properties[iterator.GetKey()] = [found.GetXMLLabel(), found.GetClassName()]
        iterator.Next()
    return {"label": prototype.GetXMLLabel(), "menu": menu_of(prototype), "properties": properties}


simple.LoadPlugin(sys.argv[1], remote=False, ns=globals())
with open(sys.argv[2], "w") as output:
    json.dump({name: describe(name) for name in ("MarrowContour", "Contour")}, output)

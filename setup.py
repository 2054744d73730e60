"""What pyproject.toml cannot say: two folders of the checkout's top are packaged inside the package, under bns/_shipped."""

from setuptools import find_namespace_packages, find_packages, setup

shipped = ("sweeps", "analysis", *(f"analysis/{name}" for name in find_packages("analysis")))
inside = {f"bns._shipped.{folder.replace('/', '.')}": folder for folder in shipped}
# Namespace packages, for folders of data in the package are found as such; but none of what Python and numba leave behind.
own = find_namespace_packages(include=["bns", "bns.*"], exclude=["*.__pycache__", "*.__pycache__.*"])
setup(packages=[*own, *inside], package_dir=inside)

"""What pyproject.toml cannot say: two folders of the checkout's top are packaged inside the package, under bns/_shipped."""

from setuptools import find_packages, setup

shipped = ("sweeps", "analysis", *(f"analysis/{name}" for name in find_packages("analysis")))
inside = {f"bns._shipped.{folder.replace('/', '.')}": folder for folder in shipped}
setup(packages=[*find_packages(include=["bns", "bns.*"]), *inside], package_dir=inside)

"""What pyproject.toml cannot say: two folders of the checkout's top are packaged inside the package, under bns/_shipped."""

from setuptools import find_packages, setup

SHIPPED = ("analysis", "sweeps")

inside = {f"bns._shipped.{name}": name.replace(".", "/") for name in (*SHIPPED, *(f"analysis.{one}" for one in find_packages("analysis")))}
setup(packages=[*find_packages(include=["bns", "bns.*"]), *inside], package_dir=inside)

"""The snake: twelve servos, driven open loop in cycles of thirteen commands (chapter 5)."""

from bns.robots.snake.robot import Snake

ROBOT = Snake()

#!/usr/bin/env python3
"""Robots over MQTT: mqtt.py --token-file web-token. Needs python3-paho-mqtt.

pheromone/robots/LINK/ID   told: {"x_m": 5.0, "y_m": 3.0, "heading_deg": 90.0, "state": "driving"}
pheromone/halt             taken: halts all robots, whatever the payload
pheromone/deposit          taken: {"pheromone": "trail", "x_m": 1, "y_m": 2, "quanta": 1}
pheromone/refused          told: why the server did not do it
"""
import argparse
import json
import time
import paho.mqtt.client as mqtt
import pheromone

parser = argparse.ArgumentParser(description="Robots over MQTT.")
parser.add_argument("--server", default=pheromone.DEFAULT_ADDRESS)
parser.add_argument("--token-file", help="authorizes changes")
parser.add_argument("--broker", default="127.0.0.1")
parser.add_argument("--port", type=int, default=1883)
options = parser.parse_args()
server = pheromone.Server(options.server, token_file=options.token_file)

def take(broker: mqtt.Client, _: object, message: mqtt.MQTTMessage) -> None:
    try:
        if message.topic == "pheromone/halt":
            server.halt()
        else:
            server.deposit(**json.loads(message.payload))
    except Exception as problem:  # whatever it is: the thread would end, and the next halt be lost
        broker.publish("pheromone/refused", str(problem))

def subscribed(topic: str) -> mqtt.Client:  # with a thread of its own: a halt waits for no deposit
    broker = mqtt.Client()
    broker.on_message = take
    broker.on_connect = lambda *_: broker.subscribe(topic, 1)
    broker.connect(options.broker, options.port)
    broker.loop_start()
    return broker

_, broker = map(subscribed, ("pheromone/deposit", "pheromone/halt"))
print("begun", flush=True)
while True:  # the server may begin anew
    try:
        for message in server.watch("/clients", timeout_s=30):
            for robot in message.value["clients"]:
                place = dict(robot["pose"] or {}, state=robot["state"]["is"])
                broker.publish(f"pheromone/robots/{robot['link']}/{robot['id']}", json.dumps(place))
    except (OSError, pheromone.ProtocolError, pheromone.Refused) as problem:
        print(problem, flush=True)
    time.sleep(1)

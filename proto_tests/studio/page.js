// The page around Foxglove Studio's front end: the layout of deploy/examples, kept in memory, and one
// data source: the server, or an MCAP file.
const {App, FoxgloveWebSocketDataSourceFactory, RemoteDataSourceFactory, AppSetting, initI18n} = self;
const parameters = new URLSearchParams(location.search);

// The layout of the examples, and beside it a panel that publishes.
const data = await (await fetch('/layout.json')).json();
data.configById['Publish!brush'] = {
  topicName: '/brush',
  datatype: parameters.get('schema'),
  buttonText: 'Paint',
  buttonTooltip: '',
  buttonColor: '#00A871',
  advancedView: true,
  value: parameters.get('brush'),
};
data.layout = {first: data.layout, second: 'Publish!brush', direction: 'row', splitPercentage: 80};

const layouts = new Map([['map', {
  id: 'map', name: 'map', permission: 'CREATOR_WRITE', baseline: {data, savedAt: undefined}, working: undefined,
  syncInfo: undefined,
}]]);
const layoutStorage = {
  list: async () => [...layouts.values()],
  get: async (namespace, id) => layouts.get(id),
  put: async (namespace, layout) => { layouts.set(layout.id, layout); return layout; },
  delete: async (namespace, id) => { layouts.delete(id); },
  importLayouts: async () => {},
};
const settings = new Map([[AppSetting.COLOR_SCHEME, 'dark'], [AppSetting.TELEMETRY_ENABLED, false],
                          [AppSetting.CRASH_REPORTING_ENABLED, false]]);
const appConfiguration = {
  get: (key) => settings.get(key),
  set: async (key, value) => { settings.set(key, value); },
  addChangeListener: () => {},
  removeChangeListener: () => {},
};

localStorage.setItem('studio.profile-data', JSON.stringify({currentLayoutId: 'map'}));
const file = parameters.get('file');
const source = file ? ['remote-file', file] : ['foxglove-websocket', parameters.get('server')];
await initI18n();
ReactDOM.render(React.createElement(App, {
  deepLinks: [`${location.origin}/?ds=${source[0]}&ds.url=${encodeURIComponent(source[1])}`],
  appConfiguration,
  dataSources: [new FoxgloveWebSocketDataSourceFactory(), new RemoteDataSourceFactory()],
  layoutStorage,
  extensionLoaders: [],
  enableGlobalCss: true,
}), document.getElementById('root'));
